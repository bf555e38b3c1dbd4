// SPDX-License-Identifier: Apache-2.0
// Pairs of features of two bodies, of which one or both move along screws, at random.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "engine/elementary/turning.h"
#include "engine/screw.h"
#include "tests/support/distance.h"
#include "tests/support/screw_oracle.h"

namespace warmfront::testing {

inline constexpr double kMostAngle = 170 * std::numbers::pi / 180;

inline Long3 wide(const std::array<double, 4>& x) {
  return {x[0], x[1], x[2]};
}

/// A body that moves from one pose to another, along a screw or along lines.
struct Mover {
  Pose from;
  Pose to;
  Twist twist;
  ScrewOracle oracle;
  bool screw;

  Mover(const Pose& first, const Pose& second, bool along_screw)
      : from(first),
        to(second),
        twist(twist_between(first, second)),
        oracle(first, second),
        screw(along_screw) {}

  VertexMotion motion(const std::array<double, 3>& x) const {
    const auto a = from.place(x.data());
    const auto b = to.place(x.data());
    return {{a[0], a[1], a[2], 0}, {b[0], b[1], b[2], 0}};
  }
  Long3 at(const VertexMotion& vertex, long double s) const {
    if (screw) return oracle.at(wide(vertex.t0), s);
    Long3 x;
    for (std::size_t k = 0; k < 3; ++k) x[k] = (1 - s) * vertex.t0[k] + s * vertex.t1[k];
    return x;
  }
  long double fastest(const VertexMotion& vertex) const {
    if (screw) return oracle.fastest(wide(vertex.t0), 0);
    long double square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const long double d = static_cast<long double>(vertex.t1[k]) - vertex.t0[k];
      square += d * d;
    }
    return std::sqrt(square);
  }
};

class TurningCase : public Draws {
 public:
  explicit TurningCase(std::uint64_t seed)
      : Draws(seed), first_(draw_mover(true)), second_(draw_mover(below(2) == 0)) {
    features.kind = below(2) == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
    const double size = below(3) == 0 ? 0.05 : 0.5;
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<double, 3> x;
      for (double& c : x) c = uniform(size);
      vertices_[k] = mover(k).motion(x);
      features.vertex[k] = &vertices_[k];
    }
    separation = below(2) == 0 ? 0 : std::abs(uniform(0.2));
  }

  const Mover& mover(std::size_t k) const { return of_first(k) ? first_ : second_; }
  bool of_first(std::size_t k) const { return k < (features.kind == ContactKind::kVertexFace ? 1U : 2U); }
  TurningPair pair() const {
    return {features, first_.screw ? &first_.twist : nullptr, second_.screw ? &second_.twist : nullptr};
  }

  /// Where the vertices are, as those that rest there.
  std::array<VertexMotion, 4> at(long double s) const {
    std::array<VertexMotion, 4> resting;
    for (std::size_t k = 0; k < 4; ++k) {
      const Long3 x = mover(k).at(vertices_[k], s);
      for (std::size_t axis = 0; axis < 3; ++axis) resting[k].t0[axis] = static_cast<double>(x[axis]);
      resting[k].t0[3] = 0;
      resting[k].t1 = resting[k].t0;
    }
    return resting;
  }
  double distance(long double s) const {
    const std::array<VertexMotion, 4> resting = at(s);
    FeatureVertices then{features.kind, {}};
    for (std::size_t k = 0; k < 4; ++k) then.vertex[k] = &resting[k];
    double size = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        if (!of_first(a) || of_first(b)) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
          size = std::max(size, std::abs(resting[a].t0[axis] - resting[b].t0[axis]));
      }
    }
    return static_cast<double>(testing::relative_distance(then, 0) * size);
  }
  /// The distance changes no faster.
  double speed() const {
    std::array<long double, 2> fastest{};
    for (std::size_t k = 0; k < 4; ++k) {
      long double& side = fastest[of_first(k) ? 0 : 1];
      side = std::max(side, mover(k).fastest(vertices_[k]));
    }
    return static_cast<double>(fastest[0] + fastest[1]);
  }

  /// The largest coordinate of any vertex at either end from where the first one begins, and all bends.
  double length() const {
    double length = 0;
    std::array<double, 2> bends{};
    for (std::size_t k = 0; k < 4; ++k) {
      const VertexMotion& v = vertices_[k];
      for (std::size_t axis = 0; axis < 3; ++axis)
        length = std::max({length, std::abs(v.t0[axis] - vertices_[0].t0[axis]),
                           std::abs(v.t1[axis] - vertices_[0].t0[axis])});
      if (!mover(k).screw) continue;
      const auto bend = mover(k).twist.bend_at({v.t0[0], v.t0[1], v.t0[2]});
      double& side = bends[of_first(k) ? 0 : 1];
      side = std::max(side, std::hypot(bend[0], bend[1], bend[2]));
    }
    return length + bends[0] + bends[1];
  }

  /// A time at which the pair is certainly within `near`, and before which, but for less than `fine`, it is
  /// certainly not; none where it is never certainly within. By halving, the earlier half first.
  std::optional<double> first_within(double near, double begin, double end, double fine) const {
    const double middle = 0.5 * (begin + end);
    const double at_middle = distance(middle);
    if (at_middle - speed_ * 0.5 * (end - begin) > near + kRounding) return std::nullopt;
    if (end - begin < fine) return at_middle <= near - kRounding ? std::optional(middle) : std::nullopt;
    if (const auto earlier = first_within(near, begin, middle, fine)) return earlier;
    return first_within(near, middle, end, fine);
  }
  void measure_speed() { speed_ = speed(); }

  FeatureVertices features{};
  double separation = 0;
  static constexpr double kRounding = 1e-12;

 private:
  Mover draw_mover(bool screw) {
    const double angle = below(4) == 0 ? 1e-3 : std::abs(uniform(kMostAngle));
    const Pose from = drawn_pose(*this, uniform(3), 0.4);
    return {from, after(from, drawn_pose(*this, angle, 0.6)), screw};
  }

  Mover first_;
  Mover second_;
  std::array<VertexMotion, 4> vertices_{};
  double speed_ = 0;
};

}  // namespace warmfront::testing
