// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/moving.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace warmfront {
namespace {

constexpr double kSqrt2Up = 1.4142135623730952;  // >= sqrt(2)
constexpr double kFloatMax = std::numeric_limits<float>::max();

// A float <= value. The cast rounds to nearest, so 2^-23 of the value and a denormal are taken off first.
inline float round_down(double value) {
  const double lowered = value - std::fabs(value) * 0x1p-23 - 0x1p-148;
  return lowered < -kFloatMax ? -std::numeric_limits<float>::infinity()
                              : static_cast<float>(std::min(lowered, kFloatMax));
}

inline void axes_of(double x, double y, double z, double (&out)[9]) {
  out[0] = x;
  out[1] = y;
  out[2] = z;
  out[3] = x + y;
  out[4] = x - y;
  out[5] = y + z;
  out[6] = y - z;
  out[7] = z + x;
  out[8] = z - x;
}

std::array<double, 3> local_position(const std::array<double, 4>& x, const LocalFrame& frame) {
  std::array<double, 3> local;
  for (int axis = 0; axis < 3; ++axis)
    local[axis] = frame.to_local(x[axis]) - frame.to_local(frame.origin[axis]);
  return local;
}

// The greater one; not a number counts as beyond everything.
double at_least(double magnitude, double x) {
  if (std::fabs(x) <= magnitude) return magnitude;
  return std::isnan(x) ? std::numeric_limits<double>::infinity() : std::fabs(x);
}

}  // namespace

double motion_magnitude(std::span<const VertexMotion> vertices, const LocalFrame& frame,
                        double min_separation) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, vertices.size(), 8192), frame.to_local(min_separation),
      [&](const auto& range, double magnitude) {
        for (std::size_t v = range.begin(); v < range.end(); ++v) {
          for (const double x : local_position(vertices[v].t0, frame)) magnitude = at_least(magnitude, x);
          for (const double x : local_position(vertices[v].t1, frame)) magnitude = at_least(magnitude, x);
        }
        return magnitude;
      },
      [](double x, double y) { return std::max(x, y); });
}

KDop18 moving_bounds(const VertexMotion& vertex, const LocalFrame& frame, double min_separation,
                     double magnitude) {
  KDop18 slabs;
  // Far out of the frame's range the bounds hold everything: slower, never wrong.
  if (!(magnitude < 1e300)) {
    slabs.lane.fill(-std::numeric_limits<float>::infinity());
    return slabs;
  }
  const auto x0 = local_position(vertex.t0, frame);
  const auto x1 = local_position(vertex.t1, frame);
  const double margin = 0x1p-44 * magnitude;
  const double straight = 0.5 * frame.to_local(min_separation) + margin;
  const double diagonal = 0.5 * kSqrt2Up * frame.to_local(min_separation) + margin;
  double at0[9];
  double at1[9];
  axes_of(x0[0], x0[1], x0[2], at0);
  axes_of(x1[0], x1[1], x1[2], at1);
  for (int k = 0; k < 9; ++k) {
    const double thick = k < 3 ? straight : diagonal;
    slabs.lane[k] = round_down(at0[k] - thick);
    slabs.lane[k + 9] = round_down(-at0[k] - thick);
    slabs.lane[k + KDop18::kEnd] = round_down(at1[k] - thick);
    slabs.lane[k + KDop18::kEnd + 9] = round_down(-at1[k] - thick);
  }
  return slabs;
}

}  // namespace warmfront
