// SPDX-License-Identifier: Apache-2.0
// Whether vertices move as one rigid body, or as a linear image of one, and how far they are from doing so.
// Plain values; used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/least_stretch.h"
#include "engine/motion/motion.h"

namespace warmfront {

/// Vertices as they were at some time, and a frame of four of them that are far apart.
class RigidReference {
 public:
  /// Where the vertices are: at t = 0 of their motions, which outlive this call only. Throws Stopped when
  /// told to stop, as fit() does.
  explicit RigidReference(std::span<const VertexMotion> vertices, StopSignal stop = {});

  /// No three vertices span a plane to speak of: nothing fits.
  bool flat() const { return flat_; }

  struct Fit {
    LinearMap linear{};  ///< with `turned` a rotation: orthonormal up to rounding
    bool turned = true;
    /// No vertex is farther than this from where the linear map, and a translation, puts its reference.
    /// Rounding is included. Infinite when it is above the limit asked for.
    double residual = 0;
  };
  /// How the vertices are at t = 1 (at t = 0 with `start`), by a rotation. O(k), less where they are off by
  /// more than `limit`.
  Fit fit(std::span<const VertexMotion> vertices, bool start, double limit, StopSignal stop = {}) const;
  /// The same by any linear map: between two places of what turns, where all have gone the same part of their
  /// ways, they are an image of the reference that no rotation makes.
  Fit fit_between(std::span<const VertexMotion> vertices, bool start, double limit,
                  StopSignal stop = {}) const;

  std::span<const double> positions() const { return positions_; }
  std::size_t memory_bytes() const { return positions_.capacity() * sizeof(double); }

 private:
  // Three edges from the first anchor, in units of the reference's first: columns. False where they have no
  // direction.
  bool edges_of(std::span<const VertexMotion> vertices, bool start, LinearMap& edges) const;
  void measure(std::span<const VertexMotion> vertices, bool start, double limit, Fit& fit,
               StopSignal stop) const;

  std::vector<double> positions_;  // (k, 3)
  std::array<std::uint32_t, 4> anchors_{};
  LinearMap frame_{};       // of the first three anchors: columns
  LinearMap from_edges_{};  // the inverse of the reference's edges_of()
  double unit_ = 1;         // the length of the first edge
  double reach_ = 0;        // the largest coordinate
  bool flat_ = true;
  bool in_plane_ = true;  // nothing is far off the plane of the first three anchors
};

/// The cosine of the angle between two rotations.
double cosine_between(const LinearMap& a, const LinearMap& b);

}  // namespace warmfront
