// SPDX-License-Identifier: Apache-2.0
// Which of a hierarchy's nodes moved in a step, or hold something else. Written by Bvh::change() and refit.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/bvh/node_set.h"
#include "engine/motion/motion.h"

namespace warmfront {

struct TreeMotion {
  std::vector<MotionState> states;  ///< by NodeId: union over the vertices below
  NodeSet changed;                  ///< nodes whose state has kChanged
  bool all_moving = false;          ///< every node's state is kMoving and kChanged
  /// By NodeId: does it hold a block that has changed since the last refit? Empty where none has.
  std::vector<std::uint8_t> renewed;
  /// By NodeId, of the nodes above the subtrees: how many of its children have been refit. Of a refit only.
  std::vector<std::uint8_t> arrived;
};

}  // namespace warmfront
