// SPDX-License-Identifier: Apache-2.0
// Motions at the ends of the range: of all that may move to far away, and by no more than rounding errors.
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "engine/pose.h"
#include "tests/support/accepted_state.h"
#include "tests/support/accepted_state_parts.h"

namespace warmfront::testing {
namespace {

// Everything that may move goes where `position` puts each number of it, half-spaces, and what else it has a
// pose for, where `pose` does.
template <class Position, class PoseOf>
StepOperation all_moved(const AcceptedState& state, Position&& position, PoseOf&& pose) {
  StepOperation operation;
  if (state.scene.bodies.empty()) {
    operation.all = state.positions;
    for (double& x : *operation.all) x = position(x);
  }
  for (std::uint32_t b = 0; b < state.scene.bodies.size(); ++b) {
    const Body& body = state.scene.bodies[b];
    if (state.fixed(b)) continue;
    if (const std::optional<Pose> to = pose(b)) {
      operation.poses.push_back({b, *to});
      continue;
    }
    if (body.half_space) continue;
    const auto first = state.positions.begin() + first_number(body);
    operation.bodies.push_back({b, {first, first + numbers(body)}});
    for (double& x : operation.bodies.back().positions) x = position(x);
  }
  return operation;
}

}  // namespace

StepOperation draw_journey(Draws& draws, const AcceptedState& state, double unit, double offset) {
  const auto there = [&](double x) { return (x - state.offset) / state.unit * unit + offset; };
  return all_moved(state, there, [&](std::uint32_t b) -> std::optional<Pose> {
    const std::optional<HalfSpace>& half_space = state.scene.bodies[b].half_space;
    if (!half_space) return std::nullopt;
    Pose pose;
    for (std::size_t axis = 0; axis < 3; ++axis)
      pose.matrix[4 * axis + 3] = offset + draws.uniform(0.5 * unit) - half_space->point[axis];
    return pose;
  });
}

StepOperation draw_noise(Draws& draws, const AcceptedState& state) {
  const auto noisy = [&](double x, double unit) {
    const double side = draws.below(2) == 0 ? 1 : -1;
    switch (draws.below(6)) {
      case 0:
      case 1:
        return std::nextafter(x, side * std::numeric_limits<double>::infinity());
      case 2:
        return x + side * std::ldexp(unit, -50 - draws.below(900));
      default:
        return x;
    }
  };
  const auto there = [&](double x) { return noisy(x, state.unit); };
  return all_moved(state, there, [&](std::uint32_t b) -> std::optional<Pose> {
    if (!state.pose[b] && !state.scene.bodies[b].half_space) return std::nullopt;
    Pose pose = state.pose[b].value_or(Pose{});
    if (!check_pose(pose, "pose")) return std::nullopt;  // on the way between two that are rigid
    for (std::size_t i = 0; i < 12; ++i) pose.matrix[i] = noisy(pose.matrix[i], i % 4 == 3 ? state.unit : 1);
    return pose;
  });
}

}  // namespace warmfront::testing
