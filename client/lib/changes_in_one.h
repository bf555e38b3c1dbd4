// SPDX-License-Identifier: Apache-2.0
// Changes that are carried out together, as the engine has them. Thread-compatible.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "client/lib/scene_changes.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// kInvalidArgument, naming the change and the vertex, for positions that float32 does not hold exactly.
Status check_float32(std::span<const SceneChange> changes);

class ChangesInOne {
 public:
  /// For a session of float32, as check_float32() has it, or of float64 positions.
  static Result<ChangesInOne> create(std::vector<SceneChange> changes, bool float32);

  std::size_t size() const { return changes_.size(); }
  /// Change number i, once; its positions are here.
  SceneEdit take(std::size_t i);

 private:
  std::vector<SceneChange> changes_;
  bool float32_ = false;
  std::vector<std::vector<float>> float_positions_;  // by change, in a session of float32
};

}  // namespace warmfront::client
