// SPDX-License-Identifier: Apache-2.0
// Sweeps: see sweep.h.
#include "client/cli/load/sweep.h"

#include <cmath>
#include <optional>
#include <string>

#include "client/io/text.h"

namespace warmfront::client::load {
namespace {

constexpr std::size_t kMostValues = 1000;

std::optional<double> positive(std::string_view text) {
  double value = 0;
  if (!parse_number(text, value) || !std::isfinite(value) || value <= 0) return std::nullopt;
  return value;
}

Error malformed_range(std::string_view text, const std::string& why) {
  return invalid_argument(in_quotes(text) + ": " + why +
                          "; give N, FIRST:LAST:xFACTOR or FIRST:LAST:+STEP, like 1:64:x2 or 10:100:+10");
}

}  // namespace

Result<std::vector<double>> parse_sweep(std::string_view text, bool whole) {
  const std::size_t first_colon = text.find(':');
  const std::optional<double> first = positive(text.substr(0, first_colon));
  if (!first) return malformed_range(text, "a positive number is expected first");
  if (whole && *first != std::floor(*first)) return malformed_range(text, "a whole number is expected");
  if (first_colon == std::string_view::npos) return std::vector<double>{*first};

  const std::string_view rest = text.substr(first_colon + 1);
  const std::size_t second_colon = rest.find(':');
  const std::optional<double> last = positive(rest.substr(0, second_colon));
  if (!last || *last < *first) return malformed_range(text, "LAST must be a number that is not below FIRST");
  const std::string_view step_text =
      second_colon == std::string_view::npos ? std::string_view() : rest.substr(second_colon + 1);
  const bool times = step_text.starts_with('x');
  if (!times && !step_text.starts_with('+')) return malformed_range(text, "the step must begin with x or +");
  const std::optional<double> step = positive(step_text.substr(1));
  if (!step || (times && *step <= 1))
    return malformed_range(text, times ? "FACTOR must be above 1" : "bad STEP");

  std::vector<double> values;
  // The slack lets a sum or product of rounded steps reach LAST itself.
  for (std::size_t k = 0;; ++k) {
    const auto n = static_cast<double>(k);
    const double exact = times ? *first * std::pow(*step, n) : *first + *step * n;
    if (exact > *last * (1 + 1e-9)) return values;
    const double value = whole ? std::round(exact) : exact;
    if (values.empty() || value > values.back()) values.push_back(value);
    if (values.size() > kMostValues || k > 1'000'000)
      return malformed_range(text, "more than " + std::to_string(kMostValues) + " values");
  }
}

}  // namespace warmfront::client::load
