// SPDX-License-Identifier: Apache-2.0
#include "engine/bounds/swept.h"

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
  return static_cast<float>(std::min(lowered, kFloatMax));
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

}  // namespace

KDop18 swept_vertex(const VertexMotion& vertex, const LocalFrame& frame, double min_separation) {
  double local[2][3];
  double magnitude = frame.to_local(min_separation);
  for (int axis = 0; axis < 3; ++axis) {
    const double origin = frame.to_local(frame.origin[axis]);
    const double x0 = frame.to_local(vertex.t0[axis]);
    const double x1 = frame.to_local(vertex.t1[axis]);
    local[0][axis] = x0 - origin;
    local[1][axis] = x1 - origin;
    magnitude = std::max({magnitude, std::fabs(origin), std::fabs(x0), std::fabs(x1)});
  }
  KDop18 slabs;
  // Far out of the frame's range the bounds hold everything: slower, never wrong.
  if (!(magnitude < 1e300)) {
    slabs.lane.fill(-std::numeric_limits<float>::infinity());
    return slabs;
  }
  const double margin = 0x1p-44 * magnitude;
  const double straight = 0.5 * frame.to_local(min_separation) + margin;
  const double diagonal = 0.5 * kSqrt2Up * frame.to_local(min_separation) + margin;
  double at0[9];
  double at1[9];
  axes_of(local[0][0], local[0][1], local[0][2], at0);
  axes_of(local[1][0], local[1][1], local[1][2], at1);
  for (int k = 0; k < 9; ++k) {
    const double thick = k < 3 ? straight : diagonal;
    slabs.lane[k] = round_down(std::min(at0[k], at1[k]) - thick);
    slabs.lane[k + 9] = round_down(-std::max(at0[k], at1[k]) - thick);
  }
  return slabs;
}

}  // namespace warmfront
