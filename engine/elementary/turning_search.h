// SPDX-License-Identifier: Apache-2.0
// What the tests of turning.h share: paths along arcs, how far their chords are from them, and the search of
// the pieces. Pure functions.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/elementary/query.h"
#include "engine/elementary/turning.h"
#include "engine/elementary/verdict.h"
#include "engine/motion/arcs.h"
#include "engine/motion/longest_way.h"

namespace warmfront::turning {

using Vector = std::array<double, 3>;

/// No piece is shorter: times are whole multiples of it, exactly.
inline constexpr int kHalvings = 26;
inline constexpr double kShortest = 0x1p-26;

inline Vector minus(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline double largest(const Vector& v) {
  return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
}

/// A vertex's path, from some point near the pair.
struct Path {
  Vector start;
  Vector way;
  Vector bend{};
  Vector turn{};
  double rounding = 0;  // what the bend is off by, at most

  Path(const VertexMotion& vertex, const Twist* twist, const std::array<double, 4>& base)
      : start(minus(vertex.t0, base)), way(minus(vertex.t1, vertex.t0)) {
    if (twist == nullptr) return;
    const Vector x{vertex.t0[0], vertex.t0[1], vertex.t0[2]};
    bend = twist->bend_at(x);
    rounding = rounding_of_bend(
        *twist, length_above({x[0] - twist->centre[0], x[1] - twist->centre[1], x[2] - twist->centre[2]}));
    const Vector& a = twist->angular;
    turn = {a[1] * bend[2] - a[2] * bend[1], a[2] * bend[0] - a[0] * bend[2],
            a[0] * bend[1] - a[1] * bend[0]};
  }

  std::array<double, 4> at(double s, const ArcShares& shares) const {
    std::array<double, 4> x{};
    for (std::size_t k = 0; k < 3; ++k)
      x[k] = (start[k] + s * way[k]) + (shares.of_bend * bend[k] + shares.of_turn * turn[k]);
    return x;
  }

  double size() const {
    Vector end;
    for (std::size_t k = 0; k < 3; ++k) end[k] = start[k] + way[k];
    return std::max(largest(start), largest(end));
  }
};

inline ArcShares shares_at(const Twist* twist, double s) {
  return twist == nullptr ? ArcShares{} : arc_shares(*twist, s);
}

/// How far chords are from arcs.
struct Margins {
  double bend = 0;      ///< of both sides together
  double rounding = 0;  ///< of positions
  double size = 0;      ///< L of turning_test()

  Margins(double bend_of_both, double rounding_of_arcs, double size_of_ends)
      : bend(bend_of_both), size(size_of_ends + bend_of_both) {
    rounding = rounding_of_arcs + 0x1p-46 * size;
  }
  bool finite() const { return std::isfinite(size) && std::isfinite(rounding) && std::isfinite(bend); }
  double of(double width) const { return (width * width * bend / 8) * (1 + 0x1p-50) + rounding; }
};

/// The length of the piece that comes next, after all that lie before `begin` in (0, 1): what was halved last
/// and whose later half waits.
inline double width_after(double begin) {
  const auto units = static_cast<std::uint64_t>(std::ldexp(begin, kHalvings));
  return std::ldexp(1.0, std::countr_zero(units) - kHalvings);
}

// A sum of two times, rounded down.
inline double time_of(double begin, double more) {
  const double sum = begin + more;
  return sum - begin > more || sum - more > begin ? std::nextafter(sum, 0.0) : sum;
}

inline double finite_sum(double a, double b) {
  return std::min(a + b, std::numeric_limits<double>::max());
}

/// The pieces, the earliest first, until one reports whose arcs are within `resolution` of their chords.
/// `reports(begin, width, margin)` tests a piece's chords, of which times are [0, 1], for coming
/// within the margin beyond the separation; `proves(begin, width, margin)` whether they come nearer than that
/// before it.
template <class Reports, class Proves>
Verdict search(const Margins& margins, double resolution, double latest, Reports&& reports, Proves&& proves) {
  if (!margins.finite()) return {true, ContactStatus::kOverlapAtStart, 0};
  double begin = 0;
  double width = 1;
  for (int pieces = 1; begin <= latest; ++pieces) {
    if (pieces > kMostPieces) return Verdict::at(begin, ContactStatus::kBudget);
    const double margin = margins.of(width);
    // All of it: what is first in a piece may be found earlier in a part of it, by rounding, and must not
    // depend on what else is asked about.
    const Verdict verdict = reports(begin, width, margin);
    if (!verdict.contact) {
      begin += width;
      if (begin >= 1) return {};
      width = width_after(begin);
    } else if (width > kShortest && margin - margins.rounding > resolution) {
      width /= 2;
      if (verdict.toi >= 0.5) begin += width;  // nothing was found before
    } else {
      const double toi = time_of(begin, verdict.toi * width);
      if (toi > latest) return {};
      if (verdict.status == ContactStatus::kBudget) return Verdict::at(toi, ContactStatus::kBudget);
      return Verdict::at(toi, proves(begin, width, margin) ? ContactStatus::kHit : ContactStatus::kPossible);
    }
  }
  return {};
}

}  // namespace warmfront::turning
