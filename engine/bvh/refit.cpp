// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <tuple>

#include "engine/bounds/lanes.h"
#include "engine/bvh/bvh.h"
#include "engine/bvh/travel_lanes.h"

namespace warmfront {
namespace {

// Bounds in registers: their lanes from kFrom on, 0 for both ends of the step or kEnd for t = 1 alone. Whole
// vectors, of which the last takes some lanes again. In registers, because bounds that are read from memory
// in other pieces than they were written in wait for their stores.
template <class Bounds, std::size_t kFrom>
struct Lanes {
  static constexpr std::size_t kTotal = std::tuple_size_v<decltype(Bounds::lane)>;
  static constexpr std::size_t kCount = (kTotal - kFrom + 7) / 8;
  static_assert(kTotal - kFrom >= 8);
  static constexpr std::size_t lane_of(std::size_t i) { return i + 1 < kCount ? kFrom + 8 * i : kTotal - 8; }

  Float8 of[kCount];

  /// Of Bounds::empty().
  WARMFRONT_INLINE Lanes() {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = Float8{} + std::numeric_limits<float>::max();
  }
  WARMFRONT_INLINE explicit Lanes(const Bounds& bounds) {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = load<Float8>(&bounds.lane[lane_of(i)]);
  }
  WARMFRONT_INLINE void merge(const Lanes& other) {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) of[i] = lesser(of[i], other.of[i]);
  }
  WARMFRONT_INLINE void store(Bounds& bounds) const {
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kCount; ++i) std::memcpy(&bounds.lane[lane_of(i)], &of[i], sizeof of[i]);
  }
};

// Where the lanes begin that a step changes, given those of the step before. An AABB's halves are less than a
// vector: both are made.
template <class Bounds>
inline constexpr std::size_t kNewLanes = Bounds::kEnd >= 8 ? Bounds::kEnd : 0;

template <class Bounds, std::size_t kFrom>
struct OfVertices;

template <std::size_t kFrom>
struct OfVertices<KDop18, kFrom> {
  WARMFRONT_INLINE static Lanes<KDop18, kFrom> merged(std::span<const KDop18> of, const Face& vertices) {
    Lanes<KDop18, kFrom> lanes(of[vertices[0]]);
    lanes.merge(Lanes<KDop18, kFrom>(of[vertices[1]]));
    lanes.merge(Lanes<KDop18, kFrom>(of[vertices[2]]));
    return lanes;
  }
};

template <std::size_t kFrom>
struct OfVertices<Aabb, kFrom> {
  WARMFRONT_INLINE static Lanes<Aabb, kFrom> merged(std::span<const KDop18> of, const Face& vertices) {
    using Float4 = float __attribute__((vector_size(16)));
    // Each end's lower and upper three, as narrow() picks them, with one lane more.
    const auto three = [&](std::size_t lane) {
      return lesser(
          lesser(load<Float4>(&of[vertices[0]].lane[lane]), load<Float4>(&of[vertices[1]].lane[lane])),
          load<Float4>(&of[vertices[2]].lane[lane]));
    };
    const Float4 a = three(0);
    const Float4 b = three(9);
    const Float4 c = three(18);
    const Float4 d = three(27);
    Lanes<Aabb, kFrom> lanes;
    const Float8 ab = __builtin_shufflevector(a, b, 0, 1, 2, 4, 5, 6, 6, 6);
    const Float8 cd = __builtin_shufflevector(c, d, 0, 1, 2, 4, 5, 6, 6, 6);
    lanes.of[0] = __builtin_shufflevector(ab, cd, 0, 1, 2, 3, 4, 5, 8, 9);
    lanes.of[1] = __builtin_shufflevector(ab, cd, 4, 5, 8, 9, 10, 11, 12, 13);
    return lanes;
  }
};

// Eight rows of eight lanes become eight lanes of eight rows.
WARMFRONT_INLINE void transpose(const float* rows, std::size_t stride, float* lanes) {
  Float8 r[8];
  Float8 s[8];
#pragma GCC unroll 8
  for (std::size_t i = 0; i < 8; ++i) r[i] = load<Float8>(rows + i * stride);
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 2) {
    s[i] = __builtin_shuffle(r[i], r[i + 1], Int8{0, 8, 2, 10, 4, 12, 6, 14});
    s[i + 1] = __builtin_shuffle(r[i], r[i + 1], Int8{1, 9, 3, 11, 5, 13, 7, 15});
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; i += 4) {
#pragma GCC unroll 8
    for (int k = 0; k < 2; ++k) {
      r[i + k] = __builtin_shuffle(s[i + k], s[i + k + 2], Int8{0, 1, 8, 9, 4, 5, 12, 13});
      r[i + k + 2] = __builtin_shuffle(s[i + k], s[i + k + 2], Int8{2, 3, 10, 11, 6, 7, 14, 15});
    }
  }
#pragma GCC unroll 8
  for (int k = 0; k < 4; ++k) {
    s[k] = __builtin_shuffle(r[k], r[k + 4], Int8{0, 1, 2, 3, 8, 9, 10, 11});
    s[k + 4] = __builtin_shuffle(r[k], r[k + 4], Int8{4, 5, 6, 7, 12, 13, 14, 15});
  }
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i) std::memcpy(lanes + 8 * i, &s[i], sizeof s[i]);
}

// The rows of eight bounds, one by one, until they are lanes.
template <class Bounds, std::size_t kFrom>
class Rows {
 public:
  using Row = Lanes<Bounds, kFrom>;

  WARMFRONT_INLINE void set(std::uint32_t slot, const Row& row) {
#pragma GCC unroll 8
    for (std::size_t k = 0; k < Row::kCount; ++k) std::memcpy(rows_[slot][k], &row.of[k], sizeof row.of[k]);
  }
  /// Puts them in place of the lanes of the last step, which become those of t = 0.
  WARMFRONT_INLINE void put(EightBounds<Bounds>& eight) {
    for (std::size_t k = 0; k < kFrom; ++k) {
      const Float8 last = load<Float8>(eight.lane[k + kFrom].data());
      std::memcpy(eight.lane[k].data(), &last, sizeof last);
      asm volatile("" ::: "memory");  // else compilers make it one string instruction, which is slower here
    }
    for (std::uint32_t i = eight.count; i < EightBounds<Bounds>::kSlots; ++i)
      std::memset(rows_[i], 0, sizeof rows_[i]);
    for (std::size_t i = 0; i < Row::kCount; ++i)
      transpose(rows_[0][i], 8 * Row::kCount, eight.lane[Row::lane_of(i)].data());
  }

 private:
  alignas(32) float rows_[EightBounds<Bounds>::kSlots][Row::kCount][8];
};

// A block's bounds as a whole.
template <std::size_t kFrom, class Bounds>
WARMFRONT_INLINE Lanes<Bounds, kFrom> refit_block(std::span<const KDop18> vertex_bounds,
                                                  LeafBlock<Bounds>& block) {
  Lanes<Bounds, kFrom> sum;
  Rows<Bounds, kFrom> rows;
  for (std::uint32_t i = 0; i < block.count; ++i) {
    const Lanes<Bounds, kFrom> row = OfVertices<Bounds, kFrom>::merged(
        vertex_bounds, {block.vertex[0][i], block.vertex[1][i], block.vertex[2][i]});
    sum.merge(row);
    rows.set(i, row);
  }
  rows.put(block);
  return sum;
}

template <std::size_t kFrom, class Bounds>
WARMFRONT_INLINE Lanes<Bounds, kFrom> refit_wide(std::span<const KDop18> vertex_bounds,
                                                 LeafBlock<Bounds>* blocks, EightBounds<Bounds>& wide) {
  Lanes<Bounds, kFrom> sum;
  Rows<Bounds, kFrom> rows;
  for (std::uint32_t i = 0; i < wide.count; ++i) {
    const Lanes<Bounds, kFrom> row = refit_block<kFrom>(vertex_bounds, blocks[i]);
    sum.merge(row);
    rows.set(i, row);
  }
  rows.put(wide);
  return sum;
}

// The bounds of a node whose children are of this step already.
template <std::size_t kFrom, class Bounds>
WARMFRONT_INLINE void refit_node(const RefitInput& input, Bvh<Bounds>& bvh, NodeId node) {
  Bounds& bounds = bvh.nodes[node];
  if constexpr (kFrom > 0) bounds.shift();
  const NodeId first_leaf = bvh.shape.first_leaf();
  if (node < first_leaf) {
    const NodeId left = TreeShape::left(node);
    Lanes<Bounds, kFrom> lanes(bvh.nodes[left]);
    lanes.merge(Lanes<Bounds, kFrom>(bvh.nodes[left + 1]));
    lanes.store(bounds);
  } else if (!bvh.wide.empty()) {
    EightBounds<Bounds>& wide = bvh.wide[node - first_leaf];
    refit_wide<kFrom>(input.vertex_bounds, &bvh.blocks[wide.first], wide).store(bounds);
  } else if (!bvh.blocks.empty()) {
    refit_block<kFrom>(input.vertex_bounds, bvh.blocks[node - first_leaf]).store(bounds);
  } else {
    const Primitive primitive = bvh.order[bvh.shape.begin(node)];
    OfVertices<Bounds, kFrom>::merged(input.vertex_bounds, primitive_vertices(input.scene, primitive))
        .store(bounds);
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
      refit_node<kNewLanes<Bounds>>(input, bvh, node);
    } else {
      refit_node<0>(input, bvh, node);
    }
    if (!bvh.travel.empty()) advance_travel(bvh, node);
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
std::size_t refit(const RefitInput& input, Bvh<Bounds>& bvh) {
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
  // Subtrees that root on one level are refit side by side, each bottom up; what is above them is small.
  const int depth = bvh.shape.levels() - 1;
  // A small hierarchy is one task: there are many more of its kind.
  constexpr std::uint32_t kSmall = 1024;
  const int task_level = bvh.shape.primitive_count() <= kSmall ? 0 : std::min(depth, 8);
  const auto refit_below = [&](std::uint32_t task) {
    const NodeId root = ((1U << task_level) - 1) + task;
    if (root >= bvh.shape.node_count()) return;
    if (from == States::kMarked && (bvh.states[root] & kChanged) == 0) return;
    for (int level = depth; level >= task_level; --level) {
      const std::uint32_t width = 1U << (level - task_level);
      const NodeId first = std::min(((1U << level) - 1) + task * width, bvh.shape.node_count());
      refit_range(input, from, bvh, first, std::min(first + width, bvh.shape.node_count()));
    }
  };
  if (task_level == 0)
    refit_below(0);
  else
    tbb::parallel_for(std::uint32_t{0}, 1U << task_level, refit_below);
  for (int level = task_level; level-- > 0;)
    refit_range(input, from, bvh, (1U << level) - 1, (2U << level) - 1);
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

template std::size_t refit(const RefitInput&, Bvh<Aabb>&);
template std::size_t refit(const RefitInput&, Bvh<KDop18>&);
template double looseness(const Bvh<Aabb>&);
template double looseness(const Bvh<KDop18>&);

}  // namespace warmfront
