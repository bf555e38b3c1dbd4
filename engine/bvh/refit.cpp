// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/bvh/bvh.h"
#include "engine/bvh/refit_lanes.h"
#include "engine/bvh/travel_lanes.h"

namespace warmfront {
namespace {

// The bounds of a node whose children are of this step already.
template <Ends kEnds, class Bounds>
WARMFRONT_INLINE void refit_node(const RefitInput& input, Bvh<Bounds>& bvh, NodeId node) {
  Bounds& bounds = bvh.nodes[node];
  if constexpr (kEnds == Ends::kNext) bounds.shift();
  const NodeId first_leaf = bvh.shape.first_leaf();
  if (node < first_leaf) {
    constexpr std::size_t kFrom = kEnds == Ends::kBoth ? 0 : kNewLanes<Bounds>;
    const NodeId left = TreeShape::left(node);
    Lanes<Bounds, kFrom> lanes(bvh.nodes[left]);
    lanes.merge(Lanes<Bounds, kFrom>(bvh.nodes[left + 1]));
    lanes.store(bounds);
  } else if (!bvh.blocks.empty()) {
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

// Where the states of nodes come from.
enum class States : std::uint8_t {
  kMarked,  // they stand already
  kGather,  // from the vertices
  kAll,     // every vertex has the range's
};

template <class Bounds>
WARMFRONT_INLINE void refit_nodes(const RefitInput& input, States from, Bvh<Bounds>& bvh, NodeId begin,
                                  NodeId end) {
  const NodeId first_leaf = bvh.shape.first_leaf();
  for (NodeId node = begin; node < end; ++node) {
    const bool leaf = node >= first_leaf;
    if (from == States::kAll) {
      bvh.states[node] = input.range.any;
    } else if (from == States::kGather) {
      bvh.states[node] = leaf ? leaf_state(input, bvh, node)
                              : bvh.states[TreeShape::left(node)] | bvh.states[TreeShape::left(node) + 1];
    }
    if (input.known == Known::kNothing) bvh.states[node] |= kChanged;
    if ((bvh.states[node] & kChanged) == 0) continue;
    if (input.known == Known::kLastStep) {
      refit_node<Ends::kNext>(input, bvh, node);
    } else if (input.known == Known::kLastTrial) {
      refit_node<Ends::kLast>(input, bvh, node);
    } else {
      refit_node<Ends::kBoth>(input, bvh, node);
    }
    if (!bvh.travel.empty()) advance_travel(input.vertex_bounds, input.magnitude, bvh, node);
  }
}

WARMFRONT_TARGET_CLONES
void refit_range(const RefitInput& input, States from, Bvh<Aabb>& bvh, NodeId begin, NodeId end) {
  refit_nodes(input, from, bvh, begin, end);
}

WARMFRONT_TARGET_CLONES
void refit_range(const RefitInput& input, States from, Bvh<KDop18>& bvh, NodeId begin, NodeId end) {
  refit_nodes(input, from, bvh, begin, end);
}

// Marks the leaves around the few vertices that changed, and what is above them.
template <class Bounds>
void mark_states(const RefitInput& input, Bvh<Bounds>& bvh) {
  std::ranges::fill(bvh.states, MotionState{0});
  for (const std::uint32_t v : input.range.changed) {
    const MotionState state = input.vertex_states[v];
    for (const std::uint32_t f : input.scene.vertex_faces()[v]) {
      for (NodeId node = bvh.leaf_of_face[f - bvh.first_face]; (bvh.states[node] & state) != state;
           node = TreeShape::parent(node)) {
        bvh.states[node] |= state;
        if (node == 0) break;
      }
    }
  }
}

bool has_points(const Scene& scene, std::span<const std::uint32_t> vertices) {
  return std::ranges::any_of(vertices, [&](std::uint32_t v) { return scene.vertex_faces()[v].empty(); });
}

}  // namespace

template <class Bounds>
std::size_t refit(const RefitInput& input, Bvh<Bounds>& bvh, const std::function<void(std::uint32_t)>& then) {
  bvh.travel_slack = std::max(bvh.travel_slack, travel::slack(input.magnitude));
  bvh.changed = {};
  bvh.all_moving = false;
  if (bvh.order.empty()) return 0;
  const bool all = input.known == Known::kNothing;
  if (input.range.any == 0 && !all) {
    if ((bvh.states[0] & kChanged) != 0) std::ranges::fill(bvh.states, MotionState{0});
    return 0;
  }
  States from = States::kGather;
  if (input.range.listed && !all && !has_points(input.scene, input.range.changed)) {
    mark_states(input, bvh);
    from = States::kMarked;
  } else if (input.range.any == input.range.all) {
    from = States::kAll;
  }
  // Subtrees are refit side by side, each bottom up; what is above them is small.
  const int depth = bvh.shape.levels() - 1;
  const int top = bvh.shape.subtree_level();
  const auto refit_subtree = [&](std::uint32_t subtree) {
    input.stop.check();
    const NodeId root = ((1U << top) - 1) + subtree;
    if (from == States::kMarked && (bvh.states[root] & kChanged) == 0) return;
    for (int level = depth; level >= top; --level) {
      const std::uint32_t width = 1U << (level - top);
      const NodeId first = std::min(((1U << level) - 1) + subtree * width, bvh.shape.node_count());
      refit_range(input, from, bvh, first, std::min(first + width, bvh.shape.node_count()));
    }
    if (then && (bvh.states[root] & kChanged) != 0) then(subtree);
  };
  if (top == 0)
    refit_subtree(0);
  else
    tbb::parallel_for(std::uint32_t{0}, bvh.shape.subtree_count(), refit_subtree);
  for (int level = top; level-- > 0;) refit_range(input, from, bvh, (1U << level) - 1, (2U << level) - 1);
  // What is above or below these has part in them: a whole level, or all leaves of a hierarchy that has less.
  constexpr NodeId kMarkBegin = (1U << 8) - 1;
  const NodeId mark_begin = std::min(bvh.shape.first_leaf(), kMarkBegin);
  const NodeId mark_end = std::min(bvh.shape.node_count(), 2 * kMarkBegin + 1);
  for (NodeId node = mark_begin; node < mark_end; ++node) {
    if ((bvh.states[node] & kChanged) != 0) bvh.changed.add(node);
  }
  std::size_t changed = 0;
  std::size_t moving = 0;
  for (const MotionState state : bvh.states) {
    changed += (state & kChanged) != 0;
    moving += (state & kMoving) != 0;
  }
  bvh.all_moving = moving == bvh.states.size();
  return changed;
}

template <class Bounds>
double looseness(const Bvh<Bounds>& bvh) {
  if (bvh.nodes.empty()) return 0;
  double sum = 0;
  for (NodeId node = 0; node < bvh.shape.first_leaf(); ++node) sum += bvh.nodes[node].extent();
  const double root = bvh.nodes[0].extent();
  return root > 0 ? sum / root : 0;
}

template std::size_t refit(const RefitInput&, Bvh<Aabb>&, const std::function<void(std::uint32_t)>&);
template std::size_t refit(const RefitInput&, Bvh<KDop18>&, const std::function<void(std::uint32_t)>&);
template double looseness(const Bvh<Aabb>&);
template double looseness(const Bvh<KDop18>&);

}  // namespace warmfront
