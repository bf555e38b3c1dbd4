// SPDX-License-Identifier: Apache-2.0
// The elementary tests of a vertex and a half-space. Pure functions except for the counts, safe to call from
// any thread in the default floating-point environment (Workers checks it).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "engine/contact.h"
#include "engine/elementary/elementary_test.h"
#include "engine/elementary/keep_distance.h"
#include "engine/elementary/verdict.h"
#include "engine/motion/motion.h"
#include "engine/options.h"

namespace warmfront {

/// A half-space at both ends of a step, in the scene's unit: point and normal move linearly, the normal
/// without being normalised. All x with n(t) . (x - p(t)) <= 0 are inside: all of space where n(t) is zero,
/// as in the middle of a half turn.
struct HalfSpaceMotion {
  std::array<std::array<double, 3>, 2> point;   ///< at t = 0 and t = 1
  std::array<std::array<double, 3>, 2> normal;  ///< likewise

  bool moves() const { return point[0] != point[1] || turns(); }
  bool turns() const { return normal[0] != normal[1]; }
};

/// When does the vertex come within options.min_separation of the half-space: at the first t in [0, 1] with
/// f(t) = n(t) . (x(t) - p(t)) <= s |n(t)|?
///   - Tier exact: toi is the largest double not above it.
///   - Tier certified misses none; toi is a lower bound. It reports no vertex that stays beyond the
///   separation
///     by more than 2^-41 times its length L: the largest coordinate of x - p, at either end, and the
///     separation. What leaves out vertices by a larger margin leaves out none that is reported.
///     What doubles leave open after the start, integers decide: status kHit or kOverlapAtStart.
///   - Tier fast does the same without error bounds.
/// Beyond doubles' comfortable range every tier is exact. What is not finite counts as overlapping.
Verdict half_space_test(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                        const ElementaryOptions& options, ElementaryCounts& counts);

/// Of Report::kCandidates: what doubles cannot exclude; status kBudget.
Verdict half_space_candidate(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                             const ElementaryOptions& options, ElementaryCounts& counts);

/// Is the vertex within options.min_separation at one instant? As proximity_test(), exactly in every tier:
/// kHit.
Verdict half_space_proximity(const VertexMotion& vertex, const HalfSpaceMotion& half_space, Instant at,
                             const ElementaryOptions& options, ElementaryCounts& counts);

/// A lower bound of the distance between the vertex and the half-space at one instant, in the scene's unit; 0
/// inside. Short of it by less than 2^-40 L.
double half_space_distance(const VertexMotion& vertex, const HalfSpaceMotion& half_space, Instant at);

/// As keep_distance_test(): the vertex's own separation follows from its distance at t = 0.
Verdict half_space_keep_distance(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                                 const KeepDistance& keep, double latest, ElementaryCounts& counts);

/// Of a vertex and a half-space in contact: weights 1, 0, 0, 0; the half-space's unit normal (at t = 0 where
/// it is zero at toi); the vertex and the half-space's nearest point, which is the vertex itself where that
/// is inside.
ContactGeometry half_space_geometry(const VertexMotion& vertex, const HalfSpaceMotion& half_space,
                                    double toi);

/// What doubles say at once of a vertex: that no test above reports it. For the tests of many.
class HalfSpaceFilter {
 public:
  /// Of a motion, or of an instant, up to a separation.
  HalfSpaceFilter(const HalfSpaceMotion& half_space, double separation, std::optional<Instant> at);

  /// False where they do not say so.
  bool clear(const VertexMotion& vertex) const {
    if (at_) {
      const std::array<double, 3> d = from_point(*at_ == Instant::kStart ? vertex.t0 : vertex.t1, end_);
      return is_more(along(end_, d), beyond_ + (of_size_ * size_of(d) + margin_));
    }
    const std::array<double, 3> d0 = from_point(vertex.t0, 0);
    const std::array<double, 3> d1 = from_point(vertex.t1, 1);
    const double least = beyond_ + (of_size_ * std::max(size_of(d0), size_of(d1)) + margin_);
    return is_more(along(0, d0), least) && is_more(along(1, d1), least) &&
           (!turns_ || is_more(0.5 * (along(0, d1) + along(1, d0)), least));
  }

 private:
  // Of numbers within double's range alone: a sum may have left it and come back.
  static bool is_more(double height, double least) {
    return height > least && height < std::numeric_limits<double>::max();
  }

  std::array<double, 3> from_point(const std::array<double, 4>& x, std::size_t end) const {
    const std::array<double, 3>& p = of_.point[end];
    return {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
  }
  double along(std::size_t end, const std::array<double, 3>& d) const {
    const std::array<double, 3>& n = of_.normal[end];
    return n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
  }
  static double size_of(const std::array<double, 3>& d) {
    return std::max({std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
  }

  HalfSpaceMotion of_;
  std::optional<Instant> at_;
  std::size_t end_ = 0;
  bool turns_ = false;
  double beyond_ = 0;   // an upper bound of the separation times |n(t)|
  double of_size_ = 0;  // the margin is this times the largest coordinate of x - p, ...
  double margin_ = 0;   // ... plus this
};

}  // namespace warmfront
