// SPDX-License-Identifier: Apache-2.0
// What a scene would cost if nothing were known of it. Used by one thread at a time.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "engine/step/warm_scene.h"

namespace warmfront {

/// A second warm scene beside a collider's own, over the same triangles and positions with everything
/// deformable and tested against itself and all else: what the scene's model saves is the difference (DESIGN
/// 5). It takes a second one's memory and time.
class AllDeformable {
 public:
  explicit AllDeformable(std::shared_ptr<Workers> workers) : workers_(std::move(workers)) {}

  /// Before a step of `core`: stands where it does, made if it is not there. Removed bodies stay out.
  void begin(const Core& core, StopSignal stop);
  /// The step that `core` has just made; none where it could not be made (it was stopped, has more
  /// contacts than options allow, or there is no memory for it).
  std::optional<StepStatistics> follow(const Core& core, StopSignal stop);
  /// Rebuilt when it is next needed: the core has moved or become another one, perhaps not for the last time
  /// before its next step.
  void forget() { scene_.reset(); }

  std::size_t memory_bytes() const { return scene_ ? scene_->memory_bytes() : 0; }

 private:
  std::shared_ptr<Workers> workers_;
  std::optional<WarmScene> scene_;
};

}  // namespace warmfront
