// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/reference_shape.h"

#include <algorithm>
#include <cmath>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

// No point of (n, 3) is farther from the centre: the root of a sum of squares, of offsets that are scaled to
// be near 1 first, so that no square leaves double's range. Places on a grid of denormal numbers are off by
// three of its steps a coordinate at most.
double radius_about(std::span<const double> points, const std::array<double, 3>& centre, StopSignal stop) {
  double largest = 0;
  in_pieces(0, points.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      largest = std::max(largest, std::fabs(points[i] - centre[i % 3]));
  });
  int exponent = 0;
  std::frexp(largest, &exponent);
  double square = 0;
  PacedStop paced(stop);
  for (std::size_t i = 0; i < points.size(); i += 3) {
    paced.check();
    double distance = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double offset = std::ldexp(points[i + axis] - centre[axis], -exponent);
      distance += offset * offset;
    }
    square = std::max(square, distance);
  }
  return std::ldexp(std::sqrt(square) * (1 + 0x1p-50), exponent) + 0x1p-1071;
}

}  // namespace

ReferenceShape::ReferenceShape(std::span<const VertexMotion> vertices, const LocalTransform& frame,
                               StopSignal stop) {
  positions.reserve(3 * vertices.size());
  std::array<double, 3> lo{};
  std::array<double, 3> hi{};
  PacedStop paced(stop);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    paced.check();
    for (int axis = 0; axis < 3; ++axis) {
      const double x = vertices[v].t1[axis];
      positions.push_back(x);
      lo[axis] = v == 0 ? x : std::min(lo[axis], x);
      hi[axis] = v == 0 ? x : std::max(hi[axis], x);
    }
  }
  for (int axis = 0; axis < 3; ++axis) centre[axis] = lo[axis] / 2 + hi[axis] / 2;
  if (!vertices.empty() && vertices.size() <= MovingPoints::kMost)
    points = RestPoints(positions, centre, frame);
  // A pose may be off a rotation by kPoseTolerance in each of nine products, and what a commit left be longer
  // by 16 times that in the square (pose.cpp): less than this.
  radius = radius_about(positions, centre, stop) * (1 + 16 * kPoseTolerance);
}

std::size_t ReferenceShape::memory_bytes() const {
  return sizeof(*this) + positions.capacity() * sizeof(double) + points.lane.capacity() * sizeof(float);
}

}  // namespace warmfront
