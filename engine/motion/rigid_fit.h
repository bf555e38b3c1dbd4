// SPDX-License-Identifier: Apache-2.0
// Whether vertices move as one rigid body, and how far they are from doing so. Plain values; used by one
// thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/motion.h"

namespace warmfront {

/// Vertices as they were at some time, and a frame of three of them that are far apart.
class RigidReference {
 public:
  /// Where the vertices are: at t = 0 of their motions, which outlive this call only. Throws Stopped when
  /// told to stop, as fit() does.
  explicit RigidReference(std::span<const VertexMotion> vertices, StopSignal stop = {});

  /// No three vertices span a plane to speak of: nothing fits.
  bool flat() const { return flat_; }

  using Rotation = std::array<double, 9>;  ///< row-major; orthonormal up to rounding

  struct Fit {
    Rotation rotation{};
    /// No vertex is farther than this from where the rotation, and a translation, puts its reference.
    /// Rounding is included. Infinite when it is above the limit asked for.
    double residual = 0;
  };
  /// How the vertices are at t = 1 (at t = 0 with `start`). O(k), less where they are off by more than
  /// `limit`.
  Fit fit(std::span<const VertexMotion> vertices, bool start, double limit, StopSignal stop = {}) const;

  std::span<const double> positions() const { return positions_; }
  std::size_t memory_bytes() const { return positions_.capacity() * sizeof(double); }

 private:
  std::vector<double> positions_;  // (k, 3)
  std::array<std::uint32_t, 3> anchors_{};
  Rotation frame_{};  // of the anchors: columns
  double reach_ = 0;  // the largest coordinate
  bool flat_ = true;
};

/// The cosine of the angle between two rotations.
double cosine_between(const RigidReference::Rotation& a, const RigidReference::Rotation& b);

}  // namespace warmfront
