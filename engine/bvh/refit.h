// SPDX-License-Identifier: Apache-2.0
// Recomputes a hierarchy's bounds for a step, bottom up. Subtrees are independent of each other, so a caller
// may make each of them a task of its own and continue there with what the subtree's bounds are needed for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/bvh/bvh.h"
#include "engine/motion/motion.h"
#include "engine/parallel/fork_join.h"
#include "engine/scene.h"
#include "engine/stop.h"

namespace warmfront {

/// What a refit reads: the step's motion, of which `range` is that of the vertices below the hierarchy.
struct RefitInput {
  const Scene& scene;
  std::span<const PointBounds> vertex_bounds;
  std::span<const MotionState> vertex_states;
  const RangeMotion& range;
  double magnitude;  ///< what the vertices' bounds were made with
  Known known;       ///< what stands in the hierarchy's bounds
  StopSignal stop = {};
};

/// Where a refit takes the states of nodes from.
enum class NodeStates : std::uint8_t {
  kUnchanged,  ///< nothing changed: all are zero
  kMarked,     ///< they are set already, from the few vertices that changed
  kGathered,   ///< from the vertices below
  kRange,      ///< every vertex has the range's
};

/// One refit of one hierarchy: begin, then each subtree once, then finish. It recomputes the bounds of what
/// changed, and adds the step's motion to these nodes' travel where it is kept. O(P) at most in all. After an
/// exception the hierarchy must be refit as a whole (Known::kNothing).
template <class Bounds>
class Refit {
 public:
  /// Begins. What `input` refers to and `bvh` must outlive the refit.
  Refit(const RefitInput& input, Bvh<Bounds>& bvh);

  /// The subtrees to refit: all of the hierarchy's (TreeShape::subtree_of()), or none when nothing changed.
  std::uint32_t subtree_count() const;
  /// Recomputes a subtree: bounds, travel and states; and the nodes above it of which all else below has been
  /// recomputed. Returns whether any node in it changed. Thread-safe for different subtrees. Throws Stopped
  /// when told to stop.
  bool refit_subtree(std::uint32_t subtree) const;
  /// After all subtrees, once each: recomputes `changed` and `all_moving`. Returns how many nodes changed.
  std::size_t finish() const;

 private:
  NodeStates begin();
  // A subtree's root has been recomputed.
  void climb(NodeId root) const;

  RefitInput input_;
  Bvh<Bounds>& bvh_;
  NodeStates states_;
};

/// Calls `body` with the number of each of `count` subtrees, in parallel; inline where there is only one.
template <class Body>
void for_subtrees(std::uint32_t count, Body&& body) {
  if (count > 1)
    fork_each(std::uint32_t{0}, count, body);
  else if (count == 1)
    body(std::uint32_t{0});
}

}  // namespace warmfront
