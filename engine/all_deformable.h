// SPDX-License-Identifier: Apache-2.0
// What a scene would cost if nothing were known of it. Used by one thread at a time.
#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "engine/collider.h"

namespace warmfront {

/// A second collider beside a session's own, over the same triangles and positions with everything deformable
/// and tested against itself and all else: what the scene's model saves is the difference (DESIGN 5). It
/// takes a second collider's memory and time.
class AllDeformable {
 public:
  /// At rest where `collider` is. Its removed bodies stay out. Nothing where there is no memory for it.
  explicit AllDeformable(const Collider& collider, std::shared_ptr<Workers> workers);

  /// The step that `collider` has just made; none where it could not be made (it was stopped, or has more
  /// contacts than options allow): the next one begins from here.
  std::optional<StepStatistics> follow(const Collider& collider, const std::atomic<bool>* cancelled);

  std::size_t memory_bytes() const { return collider_ ? collider_->memory_bytes() : 0; }

 private:
  void start(const Collider& collider);

  std::shared_ptr<Workers> workers_;
  std::optional<Collider> collider_;
};

}  // namespace warmfront
