// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/moving.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/motion/local_lanes.h"
#include "engine/motion/trial_way.h"
#include "engine/simd/target_clones.h"

namespace warmfront {
namespace {

constexpr double kSqrt2Up = 1.4142135623730952;  // >= sqrt(2)
constexpr double kFloatMax = std::numeric_limits<float>::max();

// A float <= value. The cast rounds to nearest, so subtract 2^-23 of the value and a denormal first.
WARMFRONT_INLINE float round_down(double value) {
  const double lowered = value - std::fabs(value) * 0x1p-23 - 0x1p-148;
  return lowered < -kFloatMax ? -std::numeric_limits<float>::infinity()
                              : static_cast<float>(std::min(lowered, kFloatMax));
}

template <class Real>
WARMFRONT_INLINE void axes_of(Real x, Real y, Real z, Real* out) {
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
                                                      const LocalTransform& frame) {
  std::array<double, 3> local;
  for (int axis = 0; axis < 3; ++axis)
    local[axis] = frame.to_local(x[axis]) - frame.to_local(frame.origin[axis]);
  return local;
}

// How much each axis's slabs are thickened, at t = 0 and again at t = 1.
struct Thickening {
  double lane[18];

  Thickening(const LocalTransform& frame, double min_separation, double magnitude, double radius = 0) {
    // A ball adds its own rounding to that of its vertices. A diagonal sums what two coordinates are off by.
    const double margin = ((radius > 0 ? 2 : 1) * 0x1p-44 + 2 * kBesideTheWay) * magnitude;
    const double separation =
        0.5 * frame.to_local(min_separation) * (1 + 0x1p-40) + frame.to_local(radius);
    for (int k = 0; k < 18; ++k) lane[k] = (k % 9 < 3 ? separation : kSqrt2Up * separation) + margin;
  }
};

// The lanes of one end of the step.
WARMFRONT_INLINE void bounds_at(const std::array<double, 4>& position, const LocalTransform& frame,
                                const Thickening& thickening, float* lanes) {
  const auto x = local_position(position, frame);
  double at[18];
  axes_of(x[0], x[1], x[2], at);
  for (int k = 0; k < 9; ++k) at[k + 9] = -at[k];
  for (int k = 0; k < 18; ++k) lanes[k] = round_down(at[k] - thickening.lane[k]);
}

WARMFRONT_INLINE void bounds_of(const VertexMotion& vertex, const LocalTransform& frame,
                                const Thickening& thickening, KDop18& slabs) {
  bounds_at(vertex.t0, frame, thickening, slabs.lane.data());
  bounds_at(vertex.t1, frame, thickening, slabs.lane.data() + KDop18::kEnd);
}

// Computes the PointBounds of a vertex at one end of the step.
class PointMaker {
 public:
  PointMaker(const LocalTransform& frame, double magnitude) : to_local_(frame) {
    const double thickening = Thickening(frame, 0, magnitude).lane[0];
    // The added terms far exceed the rounding of the margin, and of float32 where its exponent range ends.
    const double more = thickening * (1 + 0x1p-20) + 0x1p-126;
    thickening_ = more < kFloatMax ? static_cast<float>(more) : std::numeric_limits<float>::infinity();
  }

  WARMFRONT_INLINE void put(const std::array<double, 4>& position, std::array<float, 4>& at) const {
    Double4 x;
    std::memcpy(&x, position.data(), sizeof x);
    const Float4 local = to_floats(to_local_(x));
    const Float4 size = local < 0.0F ? -local : local;
    if ((size[0] < kFarthest) & (size[1] < kFarthest) & (size[2] < kFarthest)) {  // false for NaN
      const float largest = std::max(std::max(size[0], size[1]), size[2]);
      const Float4 point{local[0], local[1], local[2], largest * kRounding + thickening_};
      std::memcpy(at.data(), &point, sizeof point);
    } else {
      at = {0, 0, 0, std::numeric_limits<float>::infinity()};
    }
  }

 private:
  static constexpr float kFarthest = 0x1p100F;
  static constexpr float kRounding = 0x1p-21F;

  LocalLanes to_local_;
  float thickening_;
};

WARMFRONT_TARGET_CLONES
void points_of_all(std::span<const VertexMotion> vertices, std::span<const MotionState> states,
                   const PointMaker& maker, Known known, PointBounds* bounds) {
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (known != Known::kNothing && (states[v] & kChanged) == 0) continue;
    if (known == Known::kLastStep)
      bounds[v].at[0] = bounds[v].at[1];
    else if (known != Known::kLastTrial)
      maker.put(vertices[v].t0, bounds[v].at[0]);
    maker.put(vertices[v].t1, bounds[v].at[1]);
  }
}

// How far points reach along each axis's slabs, down and up: axes_of() of the least and of the largest.
WARMFRONT_TARGET_CLONES
void reaches_of(const MovingPoints& points, int end, double* reach) {
  constexpr std::size_t kLanes = 8;
  float least[18][kLanes];
  for (auto& lanes : least) std::fill(lanes, lanes + kLanes, std::numeric_limits<float>::max());
  const float* x = points.lane(end, 0);
  const float* y = points.lane(end, 1);
  const float* z = points.lane(end, 2);
  for (std::size_t i = 0; i < points.count(); i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      float at[9];
      axes_of(x[i + k], y[i + k], z[i + k], at);
      for (std::size_t axis = 0; axis < 9; ++axis) {
        least[axis][k] = std::min(least[axis][k], at[axis]);
        least[axis + 9][k] = std::min(least[axis + 9][k], -at[axis]);
      }
    }
  }
  for (std::size_t axis = 0; axis < 18; ++axis)
    reach[axis] = *std::min_element(least[axis], least[axis] + kLanes);
}

}  // namespace

PointBounds point_bounds(const VertexMotion& vertex, const LocalTransform& frame, double magnitude) {
  PointBounds bounds;
  constexpr MotionState kAny = 0;
  point_bounds({&vertex, 1}, {&kAny, 1}, frame, magnitude, Known::kNothing, &bounds);
  return bounds;
}

void point_bounds(std::span<const VertexMotion> vertices, std::span<const MotionState> states,
                  const LocalTransform& frame, double magnitude, Known known, PointBounds* bounds) {
  points_of_all(vertices, states, PointMaker(frame, magnitude), known, bounds);
}

template <class Bounds>
Bounds thickened(Bounds bounds, const LocalTransform& frame, double min_separation) {
  constexpr std::size_t kAxes = Bounds::kAxes;
  const double separation = 0.5 * frame.to_local(min_separation) * (1 + 0x1p-40);
  if (!(separation > 0)) return bounds;
  for (std::size_t k = 0; k < bounds.lane.size(); ++k)
    bounds.lane[k] =
        round_down(double{bounds.lane[k]} - (k % kAxes < 3 ? separation : kSqrt2Up * separation));
  return bounds;
}
template Aabb thickened(Aabb, const LocalTransform&, double);
template KDop18 thickened(KDop18, const LocalTransform&, double);

// Outside the frame's range, bounds contain everything: slower, never wrong.
KDop18 moving_bounds(const VertexMotion& vertex, const LocalTransform& frame, double min_separation,
                     double magnitude) {
  return moving_bounds(vertex, 0, frame, min_separation, magnitude);
}

KDop18 moving_bounds(const VertexMotion& centre, double radius, const LocalTransform& frame,
                     double min_separation, double magnitude) {
  KDop18 bounds;
  if (magnitude < 1e300)
    bounds_of(centre, frame, Thickening(frame, min_separation, magnitude, radius), bounds);
  else
    bounds.lane.fill(-std::numeric_limits<float>::infinity());
  return bounds;
}

KDop18 moving_bounds(const MovingPoints& points, const LocalTransform& frame, double min_separation,
                     double magnitude) {
  KDop18 bounds;
  bounds.lane.fill(-std::numeric_limits<float>::infinity());
  if (!(magnitude < 1e300)) return bounds;
  const Thickening thickening(frame, min_separation, magnitude);
  // The stated error of MovingPoints' coordinates, two of which a diagonal sums; the sum's own rounding is
  // less.
  const double slack = 0x1p-19 * points.radius() + 4 * points.blur() + 0x1p-44 * magnitude;
  for (int end = 0; end < 2; ++end) {
    double reach[18];
    reaches_of(points, end, reach);
    const auto& c = points.centre(end);
    const auto x = local_position({c[0], c[1], c[2], 0}, frame);
    double centre[9];
    axes_of(x[0], x[1], x[2], centre);
    for (int k = 0; k < 18; ++k) {
      const double at = k < 9 ? centre[k] : -centre[k - 9];
      bounds.lane[static_cast<std::size_t>(end * KDop18::kEnd + k)] =
          round_down(at + reach[k] - slack - thickening.lane[k]);
    }
  }
  return bounds;
}

}  // namespace warmfront
