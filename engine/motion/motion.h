// SPDX-License-Identifier: Apache-2.0
// Vertex positions at t = 0 and t = 1 of the current step, and the power-of-two frame that bounds are
// computed in. Written between steps by one thread, read by all during a step.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/result.h"

namespace warmfront {

/// One vertex's motion in a cache line: position at t = 0 and at t = 1 (the fourth lanes are zero).
struct alignas(64) VertexMotion {
  std::array<double, 4> t0;
  std::array<double, 4> t1;
};

/// Bounds are float32, so they are computed in a local frame, (x - origin) * scale, in which the scene as
/// first given has its middle at 0 and a size near 1, whatever its offset and scale. `scale` is a power of
/// two, held in two factors whose product may leave double's range. The frame is a matter of tightness only:
/// no answer depends on it.
struct LocalFrame {
  std::array<double, 3> origin{};
  double scale_a = 1;
  double scale_b = 1;

  double to_local(double length) const { return length * scale_a * scale_b; }
};

class Motion {
 public:
  /// `positions` row-major (n, 3), finite: the positions at both times.
  explicit Motion(std::span<const double> positions);

  /// Positions at t = 0 and at t = 1, row-major (n, 3). With an `order`, vertex i is row order[i] of them.
  /// Parallel inside Workers::run().
  void set(std::span<const double> x0, std::span<const double> x1, std::span<const std::uint32_t> order = {});

  std::span<const VertexMotion> vertices() const { return vertices_; }
  const LocalFrame& frame() const { return frame_; }
  std::size_t memory_bytes() const { return vertices_.size() * sizeof(VertexMotion); }

 private:
  std::vector<VertexMotion> vertices_;
  LocalFrame frame_;
};

/// kInvalidArgument unless there are 3 * vertex_count values, all finite; names the first vertex and axis
/// that is not.
template <class Real>
Status check_positions(std::span<const Real> positions, std::uint32_t vertex_count);

}  // namespace warmfront
