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
#include "engine/elementary/vec3.h"
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

  Path(const VertexMotion& vertex, const Twist* twist, const std::array<double, 4>& base)
      : start(minus(vertex.t0, base)), way(minus(vertex.t1, vertex.t0)) {
    if (twist == nullptr) return;
    const Vector x{vertex.t0[0], vertex.t0[1], vertex.t0[2]};
    bend = twist->bend_at(x);
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

  Vec3 from_base(double s, const ArcShares& shares) const {
    const std::array<double, 4> x = at(s, shares);
    return {x[0], x[1], x[2]};
  }
  Vec3 velocity(const ArcShares& rates) const {
    Vec3 v;
    v.x = way[0] + (rates.of_bend * bend[0] + rates.of_turn * turn[0]);
    v.y = way[1] + (rates.of_bend * bend[1] + rates.of_turn * turn[1]);
    v.z = way[2] + (rates.of_bend * bend[2] + rates.of_turn * turn[2]);
    return v;
  }

  double size() const {
    Vector end;
    for (std::size_t k = 0; k < 3; ++k) end[k] = start[k] + way[k];
    return std::max(largest(start), largest(end));
  }
};

/// How far a vertex begins from the centre of a twist, rounded up.
inline double from_centre(const VertexMotion& vertex, const Twist& twist) {
  return length_above(minus(vertex.t0, {twist.centre[0], twist.centre[1], twist.centre[2], 0}));
}

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
  /// The length of the longest pieces whose chords are within `resolution` of their arcs, or kShortest.
  double finest(double resolution) const {
    double width = 1;
    while (width > kShortest && of(width) - rounding > resolution) width /= 2;
    return width;
  }
};

/// How finely arcs are cut, of their pair's size, to tell whether they come nearer than they start.
inline constexpr double kFineArcs = 0x1p-40;
/// What is kept besides a separation, so that roundings take nothing of it.
inline double kept_besides(const Margins& margins) {
  return 16 * margins.rounding + 0x1p-40 * margins.size;
}
/// Of that twice, so that there is something to go by.
inline double slack_of(const Margins& margins) {
  return 2 * kept_besides(margins);
}

/// For how long what is `left` (> 0) along a direction lasts, as it changes at `rate` and with a second
/// derivative of no more than `against` (>= 0); 2 for ever.
inline double time_left(double left, double rate, double against) {
  const double root = std::sqrt(rate * rate + 2 * against * left);
  if (rate < 0) return 2 * left / (root - rate);
  return against > 0 ? (root + rate) / against : 2;
}

/// The length of the piece that comes next, after all that lie before `begin` in (0, 1): what was halved last
/// and whose later half waits.
inline double width_after(double begin) {
  const auto units = static_cast<std::uint64_t>(std::ldexp(begin, kHalvings));
  return std::ldexp(1.0, std::countr_zero(units) - kHalvings);
}

inline ArcRates rates_at(const Twist* twist, double s) {
  return twist == nullptr ? ArcRates{} : arc_rates(*twist, s);
}

// A sum of two times, rounded down.
inline double time_of(double begin, double more) {
  const double sum = begin + more;
  return sum - begin > more || sum - more > begin ? std::nextafter(sum, 0.0) : sum;
}

inline double finite_sum(double a, double b) {
  return std::min(a + b, std::numeric_limits<double>::max());
}

/// The pieces, the earliest first and `first` long, until one reports whose arcs are within `resolution` of
/// their chords. `advance(begin)` is a time, a whole multiple of `first`, up to which nothing comes within
/// the separation; `reports(begin, width, margin)` tests a piece's chords, of which times are [0, 1], for
/// coming within the margin beyond the separation; `proves(begin, width, margin)` whether they come nearer
/// than that before it.
template <class Advance, class Reports, class Proves>
Verdict search(const Margins& margins, double resolution, double first, double latest, Advance&& advance,
               Reports&& reports, Proves&& proves) {
  double begin = advance(0.0);
  double width = first;
  for (int pieces = 1; begin <= latest && begin < 1; ++pieces) {
    if (pieces > kMostPieces) return Verdict::at(begin, ContactStatus::kBudget);
    const double margin = margins.of(width);
    // All of it: what is first in a piece may be found earlier in a part of it, by rounding, and must not
    // depend on what else is asked about.
    const Verdict verdict = reports(begin, width, margin);
    if (!verdict.contact) {
      begin = advance(begin + width);
      if (begin < 1) width = std::min(width_after(begin), 2 * width);
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
