// SPDX-License-Identifier: Apache-2.0
// A description of a body, and a pose of one, from an input's bytes.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/pose.h"
#include "engine/scene.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/session_model.h"

namespace warmfront::fuzz {

/// Of kCorners vertices; the session refuses some.
inline Body any_body(Bytes& input) {
  Body body{"", 0, kCorners, static_cast<BodyKind>(input.next() % 4)};
  const std::uint8_t choice = input.next();
  body.self_collision = choice % 2 == 0;
  body.group = choice / 2 % 4;  // zero is refused
  body.mask = choice / 8 % 4;
  body.world = choice / 32 % 3;
  body.screw = choice % 5 == 0;  // refused unless it is rigid
  constexpr double kThickness[]{0, 0, 0, 0, 0.1, 1, -1, std::numeric_limits<double>::infinity()};
  body.thickness = kThickness[choice / 32];                             // the last two are refused
  if (choice == 77) body.half_space = HalfSpace{{0, 0, 0}, {0, 0, 1}};  // of a body with vertices: refused
  return body;
}

/// A turn about an axis, and a shift.
inline Pose any_pose(Bytes& input) {
  const double angle = 0.1 * input.next();
  Pose pose;
  pose.matrix[0] = pose.matrix[5] = std::cos(angle);
  pose.matrix[1] = -std::sin(angle);
  pose.matrix[4] = std::sin(angle);
  for (const int at : {3, 7, 11}) pose.matrix[at] = 0.01 * input.next() - 1;
  return pose;
}

}  // namespace warmfront::fuzz
