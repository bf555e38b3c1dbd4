// SPDX-License-Identifier: Apache-2.0
// A vertex and a half-space.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/elementary/turning.h"
#include "engine/elementary/turning_search.h"
#include "engine/elementary/vec3.h"

namespace warmfront {

using namespace turning;

namespace {

/// A vertex and the half-space, from where the vertex begins.
class HalfSpaceChords {
 public:
  HalfSpaceChords(const VertexMotion& vertex, const Twist& twist, const HalfSpaceMotion& half_space)
      : twist_(twist),
        path_(vertex, &twist, vertex.t0),
        rounding_(rounding_of_bend(twist, from_centre(vertex, twist))),
        half_space_(half_space) {
    for (Vector& point : half_space_.point) {
      for (std::size_t k = 0; k < 3; ++k) point[k] -= vertex.t0[k];
    }
  }

  Margins margins() const {
    const auto& [from, to] = half_space_.point;
    Vector way;
    for (std::size_t k = 0; k < 3; ++k) way[k] = to[k] - from[k];
    const double away = std::max(largest(from), largest(to));
    return {length_above(path_.bend), rounding_ + 0x1p-46 * away, std::max(path_.size(), largest(way))};
  }

  VertexMotion vertex(double begin, double width) const {
    return {path_.at(begin, shares_at(&twist_, begin)),
            path_.at(begin + width, shares_at(&twist_, begin + width))};
  }
  HalfSpaceMotion half_space(double begin, double width) const {
    const auto between = [&](const std::array<Vector, 2>& ends, double s) {
      if (s == 0 || s == 1 || ends[0] == ends[1]) return ends[s == 1 ? 1 : 0];
      Vector at;
      for (std::size_t k = 0; k < 3; ++k) at[k] = ends[0][k] + s * (ends[1][k] - ends[0][k]);
      return at;
    };
    const auto& [point, normal] = half_space_;
    return {{between(point, begin), between(point, begin + width)},
            {between(normal, begin), between(normal, begin + width)}};
  }

  /// For how long, after s, a half-space that does not move keeps the arc farther than `kept` from it; as
  /// Chords::kept_apart().
  double kept_apart(double s, double kept, double bend) const {
    const Vector& from = half_space_.point[0];
    const Vec3 normal{half_space_.normal[0][0], half_space_.normal[0][1], half_space_.normal[0][2]};
    const double largest = max_abs(normal);
    if (half_space_.moves() || !(largest > 0x1p-900) || !(largest < 0x1p900)) return 0;
    const Vec3 direction = (1 / norm((1 / largest) * normal)) * ((1 / largest) * normal);
    const ArcRates rates = rates_at(&twist_, s);
    const Vec3 at = path_.from_base(s, rates.shares);
    const double left = dot(direction, at - Vec3{from[0], from[1], from[2]}) - kept;
    if (!(left > 0)) return 0;
    const double rate = dot(direction, path_.velocity(rates.rates));
    return time_left(left, rate, bend * (1 + 0x1p-40)) * (1 - 0x1p-40);
  }

 private:
  const Twist& twist_;
  Path path_;
  double rounding_;
  HalfSpaceMotion half_space_;
};

Verdict search_half_space(const VertexMotion& vertex, const Twist& twist, const HalfSpaceMotion& half_space,
                          const ElementaryOptions& options, ElementaryCounts& counts) {
  const HalfSpaceChords chords(vertex, twist, half_space);
  const Margins margins = chords.margins();
  ElementaryOptions of_piece = options;
  of_piece.tier = Tier::kCertified;
  of_piece.latest = 1;
  const auto reports = [&](double begin, double width, double margin) {
    of_piece.min_separation = finite_sum(options.min_separation, margin);
    return half_space_test(chords.vertex(begin, width), chords.half_space(begin, width), of_piece, counts);
  };
  // Is the vertex, at the piece's end, within by more than its arc can be off?
  const auto proves = [&](double begin, double width, double margin) {
    const VertexMotion chord = chords.vertex(begin, width);
    const HalfSpaceMotion then = chords.half_space(begin, width);
    const Vec3 n{then.normal[1][0], then.normal[1][1], then.normal[1][2]};
    const Vec3 d{chord.t1[0] - then.point[1][0], chord.t1[1] - then.point[1][1],
                 chord.t1[2] - then.point[1][2]};
    return dot(n, d) / norm(n) + 2 * margin + 0x1p-40 * max_abs(d) < options.min_separation;
  };
  if (!margins.finite()) return {true, ContactStatus::kOverlapAtStart, 0};
  const auto advance = [](double begin) { return begin; };
  return search(margins, options.tolerance * margins.size, 1, options.latest, advance, reports, proves);
}

}  // namespace

Verdict turning_half_space_test(const VertexMotion& vertex, const Twist& twist,
                                const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                ElementaryCounts& counts) {
  return search_half_space(vertex, twist, half_space, options, counts);
}

Verdict turning_half_space_keep_distance(const VertexMotion& vertex, const Twist& twist,
                                         const HalfSpaceMotion& half_space, const KeepDistance& keep,
                                         const ElementaryOptions& options, ElementaryCounts& counts) {
  const double least = half_space_distance(vertex, half_space, Instant::kStart);
  if (!(least > keep.beyond)) return {true, ContactStatus::kOverlapAtStart, 0};
  const double own = keep.share * least + (1 - keep.share) * keep.beyond;
  ElementaryOptions of_pair = options;
  of_pair.min_separation = std::max(keep.beyond, own);
  of_pair.tolerance = std::min(
      options.tolerance, std::max(0x1p-40, 0x1p-7 * (least - of_pair.min_separation) /
                                               HalfSpaceChords(vertex, twist, half_space).margins().size));
  return search_half_space(vertex, twist, half_space, of_pair, counts);
}

bool turning_half_space_comes_within(const VertexMotion& vertex, const Twist& twist,
                                     const HalfSpaceMotion& half_space, double separation,
                                     ElementaryCounts& counts) {
  constexpr int kMostSteps = 256;
  const HalfSpaceChords chords(vertex, twist, half_space);
  const Margins margins = chords.margins();
  if (!margins.finite()) return true;
  double s = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    const double more = chords.kept_apart(s, separation + kept_besides(margins), margins.bend);
    if (!(more > 0)) break;
    s = time_of(s, std::min(more, 1.0));
    if (s >= 1) return false;
  }
  const ElementaryOptions fine{.tolerance = kFineArcs, .min_separation = separation};
  return search_half_space(vertex, twist, half_space, fine, counts).contact;
}

double turning_half_space_slack(const VertexMotion& vertex, const Twist& twist,
                                const HalfSpaceMotion& half_space) {
  return slack_of(HalfSpaceChords(vertex, twist, half_space).margins());
}

Verdict turning_half_space_candidate(const VertexMotion& vertex, const Twist& twist,
                                     const HalfSpaceMotion& half_space, const ElementaryOptions& options,
                                     ElementaryCounts& counts) {
  ElementaryOptions widened = options;
  const Margins margins = HalfSpaceChords(vertex, twist, half_space).margins();
  widened.min_separation = finite_sum(options.min_separation, margins.of(1));
  return half_space_candidate(vertex, half_space, widened, counts);
}

}  // namespace warmfront
