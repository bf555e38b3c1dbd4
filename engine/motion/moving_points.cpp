// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/moving_points.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

constexpr std::size_t padded(std::size_t points) {
  return (points + 7) / 8 * 8;
}

// Nothing here is off by more than a few units of 2^-24: all of it is less than this; and squares below
// 2^-149 vanish, as where a part is a speck beside the scene that the frame was made for.
constexpr double kRoundingUp = 1 + 0x1p-18;
constexpr double kUnderflow = 0x1p-70;

WARMFRONT_TARGET_CLONES
void turn(std::size_t count, const float* from, const float* matrix, float* to) {
  for (int row = 0; row < 3; ++row) {
    const float a = matrix[3 * row];
    const float b = matrix[3 * row + 1];
    const float c = matrix[3 * row + 2];
    float* out = to + static_cast<std::size_t>(row) * count;
    for (std::size_t i = 0; i < count; ++i)
      out[i] = (a * from[i] + b * from[count + i]) + c * from[2 * count + i];
  }
}

// The largest square of a lane's offset from the centre. In vectors: written as a loop over lanes, GCC 12
// makes six times as many instructions of it.
WARMFRONT_TARGET_CLONES
float largest_square(std::size_t count, const float* at) {
  constexpr std::size_t kLanes = sizeof(Float8) / sizeof(float);
  Float8 largest{};
  for (std::size_t i = 0; i < count; i += kLanes) {
    const auto x = load<Float8>(at + i);
    const auto y = load<Float8>(at + count + i);
    const auto z = load<Float8>(at + 2 * count + i);
    const Float8 square = (x * x + y * y) + z * z;
    largest = greater(square, largest);
  }
  float most = 0;
  for (std::size_t k = 0; k < kLanes; ++k) most = std::max(most, largest[static_cast<int>(k)]);
  return most;
}

// The middle of the vertices' box at both ends.
WARMFRONT_TARGET_CLONES
void middles(std::size_t points, const VertexMotion* vertices, std::array<std::array<double, 3>, 2>& middle) {
  std::array<Double4, 2> lo{load<Double4>(&vertices[0].t0), load<Double4>(&vertices[0].t1)};
  std::array<Double4, 2> hi = lo;
  for (std::size_t i = 1; i < points; ++i) {
    const std::array<Double4, 2> at{load<Double4>(&vertices[i].t0), load<Double4>(&vertices[i].t1)};
    for (std::size_t end = 0; end < 2; ++end) {
      lo[end] = lesser(at[end], lo[end]);
      hi[end] = greater(at[end], hi[end]);
    }
  }
  for (std::size_t end = 0; end < 2; ++end)
    for (std::size_t axis = 0; axis < 3; ++axis) middle[end][axis] = lo[end][axis] / 2 + hi[end][axis] / 2;
}

// Local offsets from the centres, as LocalTransform::to_local() has them, into lanes of `count`: x, y and z
// at one end, and then at the other. The last vertex stands for those that are missing.
WARMFRONT_TARGET_CLONES
void offsets(std::size_t points, std::size_t count, const VertexMotion* vertices, const LocalTransform& frame,
             const std::array<std::array<double, 3>, 2>& centre, float* to) {
  for (std::size_t end = 0; end < 2; ++end) {
    const Double4 from{centre[end][0], centre[end][1], centre[end][2], 0};
    float* x = to + 3 * end * count;
    float* y = x + count;
    float* z = y + count;
    for (std::size_t i = 0; i < count; ++i) {
      const VertexMotion& vertex = vertices[std::min(i, points - 1)];
      const auto at = load<Double4>(end == 0 ? &vertex.t0 : &vertex.t1);
      const Float4 local = to_floats((at - from) * frame.scale_a * frame.scale_b);
      x[i] = local[0];
      y[i] = local[1];
      z[i] = local[2];
    }
  }
}

}  // namespace

RestPoints::RestPoints(std::span<const double> rest, const std::array<double, 3>& about,
                       const LocalTransform& frame)
    : centre(about) {
  const std::size_t points = rest.size() / 3;
  const std::size_t count = padded(points);
  lane.resize(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = rest[3 * std::min(i, points - 1) + axis];
      const auto local = static_cast<float>(frame.to_local(x - centre[axis]));
      lane[axis * count + i] = local;
      // What float32 cannot hold would be no number once it is turned: then nothing is known of the part.
      reach = std::max(reach, std::isfinite(local) ? frame.to_local(std::fabs(x))
                                                   : std::numeric_limits<double>::infinity());
    }
  }
}

void MovingPoints::make_room(std::size_t points) {
  count_ = static_cast<std::uint32_t>(padded(points));
  lanes_.resize(std::size_t{6} * count_);
}

void MovingPoints::measure() {
  const float square = std::max(largest_square(count_, lane(0, 0)), largest_square(count_, lane(1, 0)));
  radius_ = std::sqrt(double{square}) * kRoundingUp + kUnderflow;
}

void MovingPoints::take(std::span<const VertexMotion> vertices, const LocalTransform& frame) {
  make_room(vertices.size());
  blur_ = 0;
  middles(vertices.size(), vertices.data(), centre_);
  offsets(vertices.size(), count_, vertices.data(), frame, centre_, room(0, 0));
  measure();
}

void MovingPoints::take(const RestPoints& rest, const Pose& from, const Pose& to,
                        const LocalTransform& frame) {
  make_room(rest.lane.size() / 3);
  blur_ = 0;
  for (int end = 0; end < 2; ++end) {
    const Pose& pose = end == 0 ? from : to;
    std::array<float, 9> matrix;
    double shift = 0;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column)
        matrix[3 * row + column] = static_cast<float>(pose.matrix[4 * row + column]);
      shift = std::max(shift, frame.to_local(std::fabs(pose.matrix[4 * row + 3])));
    }
    turn(count_, rest.lane.data(), matrix.data(), room(end, 0));
    centre_[end] = pose.place(rest.centre.data());
    // Pose::place rounds sums of three products of rest coordinates and the shift, four times a coordinate:
    // of a vertex, and of the centre; on the grid of denormal numbers by a step of it each.
    blur_ = std::max(blur_, 0x1p-47 * (4 * rest.reach + shift) + frame.to_local(0x1p-1071));
  }
  measure();
}

}  // namespace warmfront
