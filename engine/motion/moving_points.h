// SPDX-License-Identifier: Apache-2.0
// The vertices of a small part at both ends of a step, side by side, for whoever asks how far the part
// reaches in some direction. Plain values; filled by one thread, read by any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/motion.h"
#include "engine/pose.h"

namespace warmfront {

/// A rigid part's rest shape in float32 lanes, relative to its centre: what poses turn.
struct RestPoints {
  std::vector<float> lane;         ///< x of all, y of all, z of all; as MovingPoints
  std::array<double, 3> centre{};  ///< scene units
  double reach = 0;                ///< local: the largest rest coordinate

  RestPoints() = default;
  /// `rest`: (n, 3) about `about`, in scene units.
  RestPoints(std::span<const double> rest, const std::array<double, 3>& about, const LocalTransform& frame);
};

/// Each vertex relative to a centre that moves along. Lengths are in the local frame, whose coordinates are
/// float32 here: each is off by at most 2^-21 of the radius, which is never less than what underflow can
/// hide, and by `blur`.
class MovingPoints {
 public:
  /// A part of more vertices is no small one.
  static constexpr std::uint32_t kMost = 1024;

  /// Of vertices whose motion is known, kMost at most and one of them.
  void take(std::span<const VertexMotion> vertices, const LocalTransform& frame);
  /// Of a rest shape that goes from one pose to another.
  void take(const RestPoints& rest, const Pose& from, const Pose& to, const LocalTransform& frame);

  /// A multiple of eight: the last vertex stands for those that are missing.
  std::uint32_t count() const { return count_; }
  /// Coordinates along an axis at t = 0 (`end` 0) or t = 1.
  const float* lane(int end, int axis) const {
    return lanes_.data() + static_cast<std::size_t>(3 * end + axis) * count_;
  }
  /// Scene units.
  const std::array<double, 3>& centre(int end) const { return centre_[end]; }
  /// No vertex is farther from the centre.
  double radius() const { return radius_; }
  /// What rounding of the poses can hide, beside what the radius says.
  double blur() const { return blur_; }

  std::size_t memory_bytes() const { return lanes_.capacity() * sizeof(float); }

 private:
  float* room(int end, int axis) { return lanes_.data() + static_cast<std::size_t>(3 * end + axis) * count_; }
  void make_room(std::size_t points);
  void measure();

  std::uint32_t count_ = 0;
  std::vector<float> lanes_;
  std::array<std::array<double, 3>, 2> centre_{};
  double radius_ = 0;
  double blur_ = 0;
};

}  // namespace warmfront
