// SPDX-License-Identifier: Apache-2.0
// Which of a hierarchy's nodes moved in a step. Written by refit.
#pragma once

#include <vector>

#include "engine/bvh/node_set.h"
#include "engine/motion/motion.h"

namespace warmfront {

struct TreeMotion {
  std::vector<MotionState> states;  ///< by NodeId: union over the vertices below
  NodeSet changed;                  ///< nodes whose state has kChanged
  bool all_moving = false;          ///< every node's state is kMoving and kChanged
};

}  // namespace warmfront
