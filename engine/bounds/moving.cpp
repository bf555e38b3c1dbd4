// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/moving.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/target_clones.h"

namespace warmfront {
namespace {

constexpr double kSqrt2Up = 1.4142135623730952;  // >= sqrt(2)
constexpr double kFloatMax = std::numeric_limits<float>::max();

// A float <= value. The cast rounds to nearest, so 2^-23 of the value and a denormal are taken off first.
WARMFRONT_INLINE float round_down(double value) {
  const double lowered = value - std::fabs(value) * 0x1p-23 - 0x1p-148;
  return lowered < -kFloatMax ? -std::numeric_limits<float>::infinity()
                              : static_cast<float>(std::min(lowered, kFloatMax));
}

WARMFRONT_INLINE void axes_of(double x, double y, double z, double* out) {
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

WARMFRONT_INLINE std::array<double, 3> local_position(const std::array<double, 4>& x,
                                                      const LocalFrame& frame) {
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

namespace {

// By how much each axis' slabs are thickened, at t = 0 and again at t = 1.
struct Thickening {
  double lane[18];

  Thickening(const LocalFrame& frame, double min_separation, double magnitude) {
    const double margin = 0x1p-44 * magnitude;
    const double separation = 0.5 * frame.to_local(min_separation);
    for (int k = 0; k < 18; ++k) lane[k] = (k % 9 < 3 ? separation : kSqrt2Up * separation) + margin;
  }
};

WARMFRONT_INLINE void bounds_of(const VertexMotion& vertex, const LocalFrame& frame,
                                const Thickening& thickening, KDop18& slabs) {
  const auto x0 = local_position(vertex.t0, frame);
  const auto x1 = local_position(vertex.t1, frame);
  double at[18];
  axes_of(x0[0], x0[1], x0[2], at);
  axes_of(x1[0], x1[1], x1[2], at + 9);
  float lower[18];
  float upper[18];
  for (int k = 0; k < 18; ++k) lower[k] = round_down(at[k] - thickening.lane[k]);
  for (int k = 0; k < 18; ++k) upper[k] = round_down(-at[k] - thickening.lane[k]);
  for (int end = 0; end < 2; ++end) {
    std::copy_n(lower + 9 * end, 9, slabs.lane.data() + KDop18::kEnd * end);
    std::copy_n(upper + 9 * end, 9, slabs.lane.data() + KDop18::kEnd * end + 9);
  }
}

WARMFRONT_TARGET_CLONES
void bounds_of_all(std::span<const VertexMotion> vertices, const LocalFrame& frame,
                   const Thickening& thickening, KDop18* bounds) {
  for (std::size_t v = 0; v < vertices.size(); ++v) bounds_of(vertices[v], frame, thickening, bounds[v]);
}

}  // namespace

void moving_bounds(std::span<const VertexMotion> vertices, const LocalFrame& frame, double min_separation,
                   double magnitude, KDop18* bounds) {
  if (magnitude < 1e300) {
    bounds_of_all(vertices, frame, Thickening(frame, min_separation, magnitude), bounds);
    return;
  }
  // Far out of the frame's range the bounds hold everything: slower, never wrong.
  for (std::size_t v = 0; v < vertices.size(); ++v)
    bounds[v].lane.fill(-std::numeric_limits<float>::infinity());
}

KDop18 moving_bounds(const VertexMotion& vertex, const LocalFrame& frame, double min_separation,
                     double magnitude) {
  KDop18 bounds;
  moving_bounds({&vertex, 1}, frame, min_separation, magnitude, &bounds);
  return bounds;
}

}  // namespace warmfront
