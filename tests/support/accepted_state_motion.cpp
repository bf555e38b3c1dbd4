// SPDX-License-Identifier: Apache-2.0
// How a step moves what goes from pose to pose.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/screw.h"
#include "tests/support/accepted_state_parts.h"

namespace warmfront::testing {

Twists twists_of(const AcceptedState& state, const StepOperation& step) {
  Twists twists(state.scene.bodies.size());
  for (const BodyPose& pose : step.poses) {
    if (state.scene.bodies[pose.body].screw)
      twists[pose.body] = twist_between(state.pose[pose.body].value_or(Pose{}), pose.pose);
  }
  return twists;
}

std::vector<PosedRounding> posed_by(const AcceptedState& state, const StepOperation& step) {
  std::vector<PosedRounding> posed(state.scene.bodies.size());
  for (const BodyPose& pose : step.poses) {
    const Pose from = state.pose[pose.body].value_or(Pose{});
    if (from == pose.pose) continue;
    auto& [share, translation] = posed[pose.body];
    const double of_double = state.scene.bodies[pose.body].screw ? 0x1p-40 : 0x1p-42;
    share = state.rounding == Rounding::kFloat64 ? of_double : share_of(state.rounding);
    for (const std::size_t i : {3, 7, 11})
      translation = std::max({translation, std::abs(from.matrix[i]), std::abs(pose.pose.matrix[i])});
  }
  return posed;
}

std::vector<HalfSpaceMotion> half_spaces_of(const AcceptedState& state, const StepOperation* step) {
  std::vector<HalfSpaceMotion> all(state.scene.bodies.size());
  for (std::uint32_t b = 0; b < all.size(); ++b) {
    const std::optional<HalfSpace>& at_rest = state.scene.bodies[b].half_space;
    if (!at_rest) continue;
    std::array<Pose, 2> poses;
    poses.fill(state.pose[b].value_or(Pose{}));
    for (const BodyPose& pose : step != nullptr ? step->poses : std::vector<BodyPose>()) {
      if (pose.body == b) poses[1] = pose.pose;
    }
    for (std::size_t end = 0; end < 2; ++end) {
      all[b].point[end] = poses[end].place(at_rest->point.data());
      for (const int shift : {3, 7, 11}) poses[end].matrix[static_cast<std::size_t>(shift)] = 0;
      all[b].normal[end] = poses[end].place(at_rest->normal.data());
    }
  }
  return all;
}

}  // namespace warmfront::testing
