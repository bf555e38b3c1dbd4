// SPDX-License-Identifier: Apache-2.0
// Operations as a session of float32 is given them. Pure functions.
#pragma once

#include <variant>
#include <vector>

#include "engine/pose.h"
#include "engine/scene.h"
#include "tests/support/accepted_state.h"
#include "tests/support/operations.h"

namespace warmfront::test {

/// To the nearest float32, where a session's numbers are such.
class Rounded {
 public:
  explicit Rounded(bool single) : single_(single) {}

  void round(std::vector<double>& numbers) const {
    if (!single_) return;
    for (double& number : numbers) number = static_cast<float>(number);
  }
  testing::AcceptedState of(testing::AcceptedState state) const {
    round(state.positions);
    state.reference = state.positions;
    return state;
  }
  testing::StepOperation of(testing::StepOperation step) const {
    if (step.all) round(*step.all);
    for (testing::StepOperation::Rows& rows : step.bodies) round(rows.positions);
    round(step.vertex_positions);
    for (BodyPose& pose : step.poses)
      if (single_) pose.pose = in_float32(pose.pose);
    return step;
  }
  testing::AddOperation of(testing::AddOperation add) const {
    round(add.positions);
    return add;
  }
  SceneChange of(SceneChange change) const {
    if (auto* body = std::get_if<ReplaceBody>(&change)) round(body->positions);
    return change;
  }

 private:
  const bool single_;
};

}  // namespace warmfront::test
