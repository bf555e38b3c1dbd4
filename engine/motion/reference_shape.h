// SPDX-License-Identifier: Apache-2.0
// The shape of a rigid part at the identity pose. Immutable once built; free to share between threads.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "engine/motion/motion.h"
#include "engine/motion/moving_points.h"
#include "engine/pose.h"

namespace warmfront {

struct ReferenceShape {
  /// Of vertices that are where their motions end, at least one. Throws Stopped when told to stop.
  ReferenceShape(std::span<const VertexMotion> vertices, const LocalTransform& frame, StopSignal stop = {});

  std::vector<double> positions;   ///< (n, 3), in scene units
  RestPoints points;               ///< of a small part, MovingPoints::kMost vertices or fewer
  std::array<double, 3> centre{};  ///< scene units
  double radius = 0;               ///< no vertex is farther from the centre, at whatever checked pose

  std::size_t memory_bytes() const;
};

/// Where a part is: at positions, which are its vertices' own; or at a pose of a reference shape.
struct AtPositions {};
struct AtPose {
  std::shared_ptr<const ReferenceShape> shape;
  Pose pose;
};
using Placement = std::variant<AtPositions, AtPose>;

}  // namespace warmfront
