// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/check_positions.h"

#include <cmath>
#include <variant>

#include "engine/motion/all_finite.h"
#include "engine/parallel/default_environment.h"
#include "engine/parallel/join_pieces.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

constexpr std::size_t kAtOnce = std::size_t{1} << 13;

bool forks(std::size_t numbers) {
  return numbers >= 4 * kAtOnce;
}

template <class Real>
bool are_finite(std::span<const Real> numbers, StopSignal stop, Workers* workers) {
  const auto of_piece = [&](std::size_t at, std::size_t end) {
    return all_finite(numbers.data() + at, end - at);
  };
  const auto both = [](bool& all, bool piece) { all = all && piece; };
  // Not a number, and what is infinite, times zero: where that traps, it would before it is told.
  const DefaultEnvironment environment;
  bool finite = true;
  if (workers == nullptr || !forks(numbers.size()))
    in_pieces(0, numbers.size(), stop,
              [&](std::size_t at, std::size_t end) { finite = finite && of_piece(at, end); });
  else
    workers->run([&] { finite = join_pieces(0, numbers.size(), stop, true, of_piece, both, kAtOnce); });
  return finite;
}

}  // namespace

Status check_count(std::size_t values, std::uint32_t vertex_count, const std::string& what) {
  const std::size_t expected = std::size_t{3} * vertex_count;
  if (values == expected) return {};
  return invalid_argument(what + ": " + std::to_string(values) + " values where " + std::to_string(expected) +
                          " are expected (3 for each of " + std::to_string(vertex_count) + " vertices)");
}

template <class Real>
Status check_positions(std::span<const Real> positions, std::uint32_t vertex_count, const std::string& what,
                       StopSignal stop, Workers* workers) {
  if (Status status = check_count(positions.size(), vertex_count, what); !status) return status;
  const std::size_t expected = positions.size();
  if (are_finite(positions, stop, workers)) return {};
  PacedStop paced(stop);
  for (std::size_t i = 0; i < expected; ++i) {
    paced.check();
    if (!std::isfinite(positions[i])) {
      return invalid_argument(what + "[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] + ": is " +
                              (std::isnan(positions[i]) ? "not a number" : "infinite") +
                              "; coordinates must be finite");
    }
  }
  return {};
}

bool check_forks(const Positions& positions) {
  return std::visit([](auto numbers) { return forks(numbers.size()); }, positions);
}

template Status check_positions<float>(std::span<const float>, std::uint32_t, const std::string&, StopSignal,
                                       Workers*);
template Status check_positions<double>(std::span<const double>, std::uint32_t, const std::string&,
                                        StopSignal, Workers*);

}  // namespace warmfront
