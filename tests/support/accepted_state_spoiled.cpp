// SPDX-License-Identifier: Apache-2.0
// Operations with something wrong in them.
#include <cstddef>
#include <limits>

#include "tests/support/accepted_state.h"

namespace warmfront::testing {

StepOperation spoiled(Draws& draws, const AcceptedState& state, StepOperation step) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  switch (draws.below(6)) {
    case 0:
      if (!step.all) step.all = state.positions;
      (*step.all)[static_cast<std::size_t>(draws.below(static_cast<int>(step.all->size())))] =
          bad[draws.below(2)];
      if (draws.below(2) == 0) return step;  // and perhaps parts besides
      step.bodies.clear();
      step.poses.clear();
      step.vertices.clear();
      step.vertex_positions.clear();
      return step;
    case 1:
      if (!step.all) step.all = state.positions;
      step.all->pop_back();
      return step;
    case 2:
      if (!step.poses.empty()) {
        step.poses.push_back(step.poses.front());  // twice
        return step;
      }
      break;
    case 3:
      if (!step.bodies.empty()) {
        step.bodies.back().positions.back() = bad[draws.below(2)];
        return step;
      }
      break;
    case 4:
      if (!step.poses.empty()) {
        step.poses.back().pose.matrix[0] += 0.5;
        return step;
      }
      break;
    default:
      if (!step.vertices.empty()) {
        step.vertices.back() = state.scene.vertex_count;
        return step;
      }
      break;
  }
  step.vertices.push_back(0);
  step.vertices.push_back(0);
  step.vertex_positions.resize(3 * step.vertices.size(), 0.0);
  return step;
}

}  // namespace warmfront::testing
