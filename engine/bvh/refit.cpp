// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/refit.h"

#include <algorithm>
#include <atomic>

#include "engine/bvh/refit_lanes.h"
#include "engine/bvh/travel_lanes.h"

namespace warmfront {
namespace {

// The bounds of a node whose children are of this step already.
template <Ends kEnds, class Bounds>
WARMFRONT_INLINE void refit_node(const RefitInput& input, Bvh<Bounds>& bvh, NodeId node) {
  Bounds& bounds = bvh.nodes[number_of(node)];
  if constexpr (kEnds == Ends::kNext) bounds.shift();
  const NodeId first_leaf = bvh.shape.first_leaf();
  if (node < first_leaf) {
    constexpr std::size_t kFrom = kEnds == Ends::kBoth ? 0 : kNewLanes<Bounds>;
    const std::uint32_t left = number_of(TreeShape::left(node));
    Lanes<Bounds, kFrom> lanes(bvh.nodes[left]);
    lanes.merge(Lanes<Bounds, kFrom>(bvh.nodes[left + 1]));
    lanes.store(bounds);
  } else if (!bvh.leaves.blocks.empty()) {
    refit_leaf<kEnds>(input.vertex_bounds, bvh, node);
  } else {
    bounds = Bounds::empty();
    for (const std::uint32_t v : primitive_vertices(input.scene, bvh.order[bvh.shape.begin(node)]))
      bounds.merge(narrow<Bounds>(bounds_of(input.vertex_bounds[v])));
  }
}

// The union of the vertices' states in a leaf.
template <class Bounds>
MotionState leaf_state(const RefitInput& input, const Bvh<Bounds>& bvh, NodeId node) {
  MotionState state = 0;
  const std::uint32_t end = bvh.shape.end(node);
  for (std::uint32_t i = bvh.shape.begin(node); i < end; ++i) {
    for (const std::uint32_t v : primitive_vertices(input.scene, bvh.order[i])) {
      state |= input.vertex_states[v];
      if (state == (kMoving | kChanged)) return state;  // most often the first says it all
    }
  }
  return state;
}

template <class Bounds>
WARMFRONT_INLINE void refit_nodes(const RefitInput& input, NodeStates from, Bvh<Bounds>& bvh, NodeId begin,
                                  NodeId end) {
  const NodeId first_leaf = bvh.shape.first_leaf();
  const std::uint8_t* const renewed = bvh.motion.renewed.empty() ? nullptr : bvh.motion.renewed.data();
  for (NodeId node = begin; node < end; ++node) {
    const bool leaf = node >= first_leaf;
    MotionState& state = bvh.motion.states[number_of(node)];
    if (from == NodeStates::kRange) {
      state = input.range.any;
    } else if (from == NodeStates::kGathered) {
      const std::uint32_t left = number_of(TreeShape::left(node));
      state = leaf ? leaf_state(input, bvh, node) : bvh.motion.states[left] | bvh.motion.states[left + 1];
    }
    const Known known = renewed != nullptr && renewed[number_of(node)] != 0 ? Known::kNothing : input.known;
    if (known == Known::kNothing) state |= kChanged;
    if ((state & kChanged) == 0) continue;
    if (known == Known::kLastStep) {
      refit_node<Ends::kNext>(input, bvh, node);
    } else if (known == Known::kLastTrial) {
      refit_node<Ends::kLast>(input, bvh, node);
    } else {
      refit_node<Ends::kBoth>(input, bvh, node);
    }
    if (!bvh.travel.nodes.empty()) advance_travel(input.vertex_bounds, input.magnitude, bvh, node);
  }
}

WARMFRONT_TARGET_CLONES
void refit_range(const RefitInput& input, NodeStates from, Bvh<Aabb>& bvh, NodeId begin, NodeId end) {
  refit_nodes(input, from, bvh, begin, end);
}

WARMFRONT_TARGET_CLONES
void refit_range(const RefitInput& input, NodeStates from, Bvh<KDop18>& bvh, NodeId begin, NodeId end) {
  refit_nodes(input, from, bvh, begin, end);
}

// Marks the leaves around the few vertices that changed, and what is above them.
template <class Bounds>
void mark_states(const RefitInput& input, Bvh<Bounds>& bvh) {
  std::ranges::fill(bvh.motion.states, MotionState{0});
  for (const std::uint32_t v : input.range.changed) {
    const MotionState state = input.vertex_states[v];
    const auto mark = [&](NodeId node) {
      for (; (bvh.motion.states[number_of(node)] & state) != state; node = TreeShape::parent(node)) {
        bvh.motion.states[number_of(node)] |= state;
        if (node == kRoot) break;
      }
    };
    for (const std::uint32_t f : input.scene.vertex_faces()[v]) mark(bvh.face_leaves.of(NewFace{f}));
    for (const EdgeId e : lone_edges_of(input.scene, v)) mark(bvh.segment_leaves.of(e));
  }
}

bool has_points(const Scene& scene, std::span<const std::uint32_t> vertices) {
  return std::ranges::any_of(vertices, [&](std::uint32_t v) { return scene.is_isolated(v); });
}

}  // namespace

template <class Bounds>
Refit<Bounds>::Refit(const RefitInput& input, Bvh<Bounds>& bvh)
    : input_(input), bvh_(bvh), states_(begin()) {}

template <class Bounds>
NodeStates Refit<Bounds>::begin() {
  bvh_.travel.slack = std::max(bvh_.travel.slack, travel::slack(input_.magnitude));
  bvh_.motion.changed = {};
  bvh_.motion.all_moving = false;
  bvh_.motion.arrived.assign(bvh_.shape.subtree_count() - 1, 0);
  if (bvh_.order.empty()) return NodeStates::kUnchanged;
  const RangeMotion& range = input_.range;
  const bool all = input_.known == Known::kNothing || !bvh_.motion.renewed.empty();
  if (range.any == 0 && !all) {
    if ((bvh_.motion.states.front() & kChanged) != 0) std::ranges::fill(bvh_.motion.states, MotionState{0});
    return NodeStates::kUnchanged;
  }
  if (range.listed && !all && !has_points(input_.scene, range.changed)) {
    mark_states(input_, bvh_);
    return NodeStates::kMarked;
  }
  return range.any == range.all ? NodeStates::kRange : NodeStates::kGathered;
}

template <class Bounds>
std::uint32_t Refit<Bounds>::subtree_count() const {
  return states_ == NodeStates::kUnchanged ? 0 : bvh_.shape.subtree_count();
}

template <class Bounds>
bool Refit<Bounds>::refit_subtree(std::uint32_t subtree) const {
  input_.stop.check();
  const TreeShape& shape = bvh_.shape;
  const NodeId root = shape.subtree_root(subtree);
  if (states_ == NodeStates::kMarked && (bvh_.motion.states[number_of(root)] & kChanged) == 0) {
    climb(root);
    return false;
  }
  const int top = shape.subtree_level();
  for (int level = shape.levels() - 1; level >= top; --level) {
    const std::uint32_t width = 1U << (level - top);
    const NodeId first = std::min(TreeShape::first_of_level(level) + subtree * width, shape.end_node());
    refit_range(input_, states_, bvh_, first, std::min(first + width, shape.end_node()));
  }
  climb(root);
  return bvh_.subtree_changed(subtree);
}

// Of two children the one that ends last sees to their parent: nobody waits. Source: Karras 2012, "Maximizing
// Parallelism in the Construction of BVHs, Octrees, and k-d Trees", section 4.
template <class Bounds>
void Refit<Bounds>::climb(NodeId node) const {
  while (node != kRoot) {
    node = TreeShape::parent(node);
    const std::atomic_ref<std::uint8_t> arrived(bvh_.motion.arrived[number_of(node)]);
    if (arrived.fetch_add(1, std::memory_order_acq_rel) == 0) return;
    refit_range(input_, states_, bvh_, node, node + 1);
  }
}

template <class Bounds>
std::size_t Refit<Bounds>::finish() const {
  if (states_ == NodeStates::kUnchanged) return 0;
  // What is above or below these has part in them: a whole level, or all leaves of a hierarchy that has less.
  constexpr int kMarked = 8;
  const NodeId mark_begin = std::min(bvh_.shape.first_leaf(), TreeShape::first_of_level(kMarked));
  const NodeId mark_end = std::min(bvh_.shape.end_node(), TreeShape::first_of_level(kMarked + 1));
  for (NodeId node = mark_begin; node < mark_end; ++node) {
    if ((bvh_.motion.states[number_of(node)] & kChanged) != 0) bvh_.motion.changed.add(node);
  }
  std::size_t changed = 0;
  std::size_t moving = 0;
  for (const MotionState state : bvh_.motion.states) {
    changed += (state & kChanged) != 0;
    moving += (state & kMoving) != 0;
  }
  bvh_.motion.all_moving = moving == bvh_.motion.states.size();
  bvh_.motion.renewed = {};
  return changed;
}

template class Refit<Aabb>;
template class Refit<KDop18>;
}  // namespace warmfront
