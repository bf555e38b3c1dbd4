// SPDX-License-Identifier: Apache-2.0
// What a scene would cost if nothing were known of it. Used by one thread at a time.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include "engine/collider.h"

namespace warmfront {

/// A second collider beside a session's own, over the same triangles and positions with everything deformable
/// and tested against itself and all else: what the scene's model saves is the difference (DESIGN 5). It
/// takes a second collider's memory and time.
class AllDeformable {
 public:
  explicit AllDeformable(std::shared_ptr<Workers> workers) : workers_(std::move(workers)) {}

  /// Before a step of `collider`: stands where it does, made if it is not there. Removed bodies stay out.
  void begin(const Collider& collider, const std::atomic<bool>* cancelled);
  /// The step that `collider` has just made; none where it could not be made (it was stopped, has more
  /// contacts than options allow, or there is no memory for it).
  std::optional<StepStatistics> follow(const Collider& collider, const std::atomic<bool>* cancelled);
  /// Made anew when it is next needed: `collider` has moved or become another one, perhaps not for the last
  /// time before its next step.
  void forget() { collider_.reset(); }

  std::size_t memory_bytes() const { return collider_ ? collider_->memory_bytes() : 0; }

 private:
  std::shared_ptr<Workers> workers_;
  std::optional<Collider> collider_;
};

}  // namespace warmfront
