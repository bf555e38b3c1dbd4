// SPDX-License-Identifier: Apache-2.0
// Checks part by part and segment by segment. Thread safety: see the header.
#include "engine/check/self_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/node_patches.h"
#include "engine/bvh/topology_checksum.h"
#include "engine/check/check_neighbours.h"
#include "engine/front/descend.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

std::string text(const NodePair& pair) {
  return "(" + std::to_string(number_of(pair.a)) + ", " + std::to_string(number_of(pair.b)) + ")";
}

/// The first fault found by any thread.
class Finding {
 public:
  explicit operator bool() const { return found_.load(std::memory_order_relaxed); }
  void report(ErrorCode code, const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (!found_.exchange(true)) error_ = Error{code, "self-check: " + what};
  }
  Status status() const { return error_ ? Status(*error_) : Status(); }

 private:
  std::atomic<bool> found_{false};
  std::mutex mutex_;
  std::optional<Error> error_;
};

template <class Bounds>
bool holds(const Bounds& outer, const Bounds& inner) {
  bool all = true;
  for (std::size_t k = 0; k < outer.lane.size(); ++k) all &= outer.lane[k] <= inner.lane[k];
  return all;
}

template <class Bounds>
class SelfCheck {
 public:
  explicit SelfCheck(const KeptState<Bounds>& kept) : kept_(kept), core_(kept.core) {}

  Status run() {
    if (checksum(core_, kept_.stop) != core_.checksum())
      found_.report(ErrorCode::kDataLoss, "the scene's topology has changed");
    if (filter_checksum(core_.filter, kept_.stop) != core_.filter.built_sum())
      found_.report(ErrorCode::kDataLoss, "what the scene's filters leave out has changed");
    if (thickness_checksum(core_.thickness, kept_.stop) != core_.thickness.built_sum())
      found_.report(ErrorCode::kDataLoss, "the thickness of the scene's vertices has changed");
    if (kept_.trees.size() != core_.topology->parts.size())
      found_.report(ErrorCode::kInternal, "the numbers of parts and hierarchies differ");
    if (!found_) {
      tbb::parallel_for(std::size_t{0}, kept_.trees.size(),
                        [&](std::size_t p) { check_part(PartId{static_cast<std::uint32_t>(p)}); });
    }
    if (!found_) check_near();
    if (!found_) check_apart();
    if (!found_ && kept_.front != nullptr) check_front();
    return found_.status();
  }

 private:
  void broken(const std::string& what) { found_.report(ErrorCode::kInternal, what); }

  // Are the part's bounds those of the last step?
  bool current(PartId p) const {
    return !core_.model.is_removed(p) && kept_.refit_in[number_of(p)] == kept_.step &&
           !kept_.trees[number_of(p)].nodes.empty() && !kept_.trees[number_of(p)].order.empty();
  }

  void check_part(PartId p) {
    kept_.stop.check();
    if (!current(p)) return;
    const std::string of_part = " of part " + std::to_string(number_of(p));
    if (!holds_each_once(p))
      return broken("the hierarchy" + of_part + " does not contain each primitive exactly once");
    if (kept_.trees[number_of(p)].patches != patches_of(p))
      return broken("the patches of nodes" + of_part + " are not those of the filters");
    if (!leaves_agree(p)) return broken("the leaves" + of_part + " do not match its primitive order");
    const FeatureRange& features = core_.topology->parts[number_of(p)].features;
    for_each_index(features.first_vertex, features.end_vertex, kept_.stop, [&](std::size_t i) {
      const auto v = static_cast<std::uint32_t>(i);
      const Motion& motion = core_.motion.vertices();
      const PointBounds bounds = point_bounds(motion.vertices()[v], motion.frame(), kept_.magnitude);
      if (!(core_.vertex_bounds[v] == bounds))
        found_.report(ErrorCode::kDataLoss,
                      "vertex " + std::to_string(number_of(core_.topology->numbering.given(NewVertex{v}))) +
                          " is outside its bounds");
    });
    const Bvh<Bounds>& tree = kept_.trees[number_of(p)];
    for_each_index(
        0, tree.shape.node_count(), kept_.stop,
        [&](std::size_t i) {
          if (!node_holds(tree, NodeId{static_cast<std::uint32_t>(i)}))
            broken("node " + std::to_string(i) + of_part + " does not contain its children");
        },
        kNodesAtOnce);
  }

  std::vector<std::uint32_t> patches_of(PartId p) const {
    const Bvh<Bounds>& tree = kept_.trees[number_of(p)];
    return node_patches(core_.topology->scene, tree.shape, tree.order, core_.filter.patches(), kept_.stop);
  }

  bool holds_each_once(PartId p) const {
    const PartTopology& part = core_.topology->parts[number_of(p)];
    const Bvh<Bounds>& tree = kept_.trees[number_of(p)];
    if (tree.order.size() != part.order.size() || tree.nodes.size() != tree.shape.node_count() ||
        tree.shape.primitive_count() != part.shape.primitive_count() ||
        tree.shape.leaf_count() != part.shape.leaf_count())
      return false;
    // At first this is the hierarchy's own order, later always a permutation of it.
    if (std::ranges::equal(tree.order, part.order)) return true;
    std::vector<Primitive> order(tree.order), first(part.order);
    PacedStop paced(kept_.stop);
    const auto less = [&](Primitive a, Primitive b) {
      paced.check();
      return a < b;
    };
    std::ranges::sort(order, less);
    std::ranges::sort(first, less);
    return order == first;
  }

  bool leaves_agree(PartId p) const {
    const Bvh<Bounds>& tree = kept_.trees[number_of(p)];
    const TreeShape& shape = tree.shape;
    if (!tree.leaves.blocks.empty() && (tree.leaves.blocks.size() != shape.block_count() ||
                                        tree.leaves.corners.size() != shape.block_count() ||
                                        tree.leaves.grids.size() != shape.leaf_count() ||
                                        tree.leaves.blocks_of.size() != shape.leaf_count()))
      return false;
    if (!tree.leaves.wide.empty() && tree.leaves.wide.size() != shape.leaf_count()) return false;
    PacedStop paced(kept_.stop, kNodesAtOnce);
    for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf) {
      paced.check();
      for (std::uint32_t i = shape.begin(leaf); i < shape.end(leaf); ++i) {
        if (is_point(tree.order[i])) continue;
        const LeavesOfKind& leaves = is_face(tree.order[i]) ? tree.face_leaves : tree.segment_leaves;
        const std::uint32_t at = number_in_kind(tree.order[i]) - leaves.first;
        if (at >= leaves.leaf.size() || leaves.leaf[at] != leaf) return false;
      }
      if (!tree.leaves.blocks.empty() && !blocks_agree(tree, leaf)) return false;
    }
    return tree.leaves.shared == nullptr ||
           *tree.leaves.shared == *shared_vertices(core_.topology->scene, shape, tree.order, kept_.stop);
  }

  bool blocks_agree(const Bvh<Bounds>& tree, NodeId leaf) const {
    const BlockRange blocks{tree.shape.first_block(leaf), tree.shape.end_block(leaf)};
    const std::uint32_t l = number_of(tree.shape.leaf_of(leaf));
    if (tree.leaves.grids[l].begin_at_1 != 0 && tree.leaves.grids[l].begin_at_1 != Bounds::kAxes)
      return false;
    if (!(tree.leaves.blocks_of[l] == blocks)) return false;
    for (BlockId block = blocks.begin; block < blocks.end; ++block) {
      const std::uint32_t begin = tree.shape.begin_of_block(block);
      const std::uint32_t size = tree.shape.size_of_block(block);
      for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
        const Face vertices =
            primitive_vertices(core_.topology->scene, tree.order[begin + (i < size ? i : 0)]);
        for (std::size_t k = 0; k < 3; ++k)
          if (tree.leaves.corners[number_of(block)].vertex[k][i] != vertices[k]) return false;
      }
    }
    return true;
  }

  bool node_holds(const Bvh<Bounds>& tree, NodeId node) const {
    const Bounds& bounds = tree.nodes[number_of(node)];
    if (!tree.shape.is_leaf(node)) {
      return holds(bounds, tree.nodes[number_of(TreeShape::left(node))]) &&
             holds(bounds, tree.nodes[number_of(TreeShape::right(node))]);
    }
    const auto holds_primitive = [&](std::uint32_t position, auto&& holds_bounds) {
      const Face vertices = primitive_vertices(core_.topology->scene, tree.order[position]);
      return std::ranges::all_of(vertices, [&](std::uint32_t v) {
        const Bounds inner = narrow<Bounds>(bounds_of(core_.vertex_bounds[v]));
        return holds(bounds, inner) && holds_bounds(inner);
      });
    };
    if (tree.leaves.blocks.empty())
      return holds_primitive(tree.shape.begin(node), [](const Bounds&) { return true; });
    const std::uint32_t leaf = number_of(tree.shape.leaf_of(node));
    const BlockRange blocks = tree.leaves.blocks_of[leaf];
    const LeafGrid<Bounds>& grid = tree.leaves.grids[leaf];
    LeafGrid<Bounds> own;
    own.set(bounds, 0);
    own.set(bounds, 1);
    if (!(own == grid)) return false;
    for (BlockId block = blocks.begin; block < blocks.end; ++block) {
      const std::uint32_t begin = tree.shape.begin_of_block(block);
      const std::uint32_t size = tree.shape.size_of_block(block);
      for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
        const bool held = holds_primitive(begin + (i < size ? i : 0), [&](const Bounds& inner) {
          return holds_numbers(grid, tree.leaves.blocks[number_of(block)], i, inner) &&
                 (tree.leaves.wide.empty() ||
                  holds_numbers(grid, tree.leaves.wide[leaf], block - blocks.begin, inner));
        });
        if (!held) return false;
      }
    }
    return true;
  }

  static bool holds_numbers(const LeafGrid<Bounds>& grid, const EightBounds<Bounds>& eight,
                            std::uint32_t slot, const Bounds& inner) {
    constexpr std::size_t kAxes = Bounds::kAxes;
    for (std::size_t t = 0; t < 2; ++t) {
      const auto& end = grid.end[t];
      const double unit = std::ldexp(1.0, end.exponent);
      for (std::size_t k = 0; k < kAxes; ++k) {
        const std::int16_t* number = OneOfLeaf::of(eight, grid.begin_at_1, slot)(t, k);
        const float* lower = &inner.lane[t * Bounds::kEnd + k];
        if (end.none() ? number[0] != grid.kNever || number[1] != grid.kNever
                       : !(end.origin[k] + number[0] * unit <= lower[0]) ||
                             !(number[1] * unit - end.origin[k] <= lower[kAxes]))
          return false;
      }
    }
    return true;
  }

  // Pairs of parts that may meet and whose bounds overlap must be in `near` or `apart`.
  void check_near() {
    const auto parts = static_cast<std::uint32_t>(kept_.roots.size());
    constexpr std::uint64_t kTests = 1U << 20;
    const std::uint64_t rows = std::clamp<std::uint64_t>(kTests / std::max(parts, 1U), 1, parts);
    tbb::parallel_for(std::uint64_t{0}, rows, [&](std::uint64_t row) {
      PacedStop paced(kept_.stop);
      kept_.stop.check();
      const PartId p{static_cast<std::uint32_t>((kept_.turn * rows + row) % parts)};
      for (PartId q{0}; q < PartId{parts}; ++q) {
        paced.check();
        const PartPair pair{std::min(p, q), std::max(p, q)};
        if (core_.model.is_removed(p) || core_.model.is_removed(q)) continue;
        if (p == q ? !core_.tests_itself(p)
                   : !core_.model.may_meet(p, q) ||
                         !overlap(kept_.roots[number_of(p)], kept_.roots[number_of(q)]))
          continue;
        if (!std::ranges::binary_search(kept_.near, pair, {}, &NearPair::parts) &&
            !std::ranges::binary_search(kept_.turning, pair, {}, &NearPair::parts) &&
            !std::ranges::binary_search(kept_.apart, pair, {}, &ApartPair::parts))
          return broken("parts " + std::to_string(number_of(pair.a)) + " and " +
                        std::to_string(number_of(pair.b)) + " are near but have no front");
      }
    });
  }

  // All of b must lie beyond all of a, at both ends.
  void check_apart() {
    for_each_index(0, kept_.apart.size(), kept_.stop, [&](std::size_t i) {
      const ApartPair& pair = kept_.apart[i];
      const double separation =
          core_.arcs.widened(core_.thickness.between(core_.asked_separation, pair.parts.a, pair.parts.b),
                             pair.parts.a, pair.parts.b);
      const VertexMotion base = core_.motion.vertex(pair.parts.a, 0);
      for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
        const auto along = [&](PartId part, std::uint32_t v) {
          const VertexMotion vertex = core_.motion.vertex(part, v);
          double sum = 0;
          for (std::size_t k = 0; k < 3; ++k) sum += pair.direction[k] * ((vertex.*end)[k] - (base.*end)[k]);
          return sum;
        };
        double most = 0;
        for (std::uint32_t v = 0; v < core_.motion.vertex_count(pair.parts.a); ++v)
          most = std::max(most, along(pair.parts.a, v));
        for (std::uint32_t v = 0; v < core_.motion.vertex_count(pair.parts.b); ++v) {
          if (!(along(pair.parts.b, v) - most > separation))
            return broken("parts " + std::to_string(number_of(pair.parts.a)) + " and " +
                          std::to_string(number_of(pair.parts.b)) +
                          " are not apart along the direction that is stored");
        }
      }
    });
  }

  void check_front() {
    const std::span<const FrontSegment> segments = kept_.front->segments();
    if (!std::ranges::equal(segments, kept_.near, {}, &FrontSegment::parts, &NearPair::parts))
      return broken("the front's segments do not match the pairs of near parts");
    std::size_t size = 0;
    for (const FrontSegment& segment : segments) size += segment.size;
    if (size != kept_.front->size()) return broken("the front has a wrong pair count");
    tbb::parallel_for(std::size_t{0}, segments.size(), [&](std::size_t s) {
      const FrontSegment& segment = segments[s];
      if (!current(segment.parts.a) || !current(segment.parts.b)) return;
      check_cut(segment);
      check_neighbours(segment);
      tbb::parallel_for(std::size_t{0}, segment.chunks.size(),
                        [&](std::size_t c) { check_chunk(segment, segment.chunks[c]); });
    });
  }

  void check_neighbours(const FrontSegment& segment) {
    const PartId part = segment.parts.a;
    // None are listed where the front is not lazy, or has no room.
    if (!segment.with_itself() || !kept_.front->neighbours().listed(part)) return;
    const std::string wrong = broken_neighbours(
        kept_.front->neighbours().of(part), kept_.trees[number_of(part)], core_.topology->scene,
        core_.vertex_bounds, kept_.widths.of(segment.parts), kept_.turn, kept_.stop);
    if (!wrong.empty()) broken("the front" + of(segment) + " " + wrong);
  }

  static std::string of(const FrontSegment& segment) {
    return " of parts " + std::to_string(number_of(segment.parts.a)) + " and " +
           std::to_string(number_of(segment.parts.b));
  }

  // A depth-first walk of the test tree meets the front's pairs in order: each path from the root ends at one
  // of them.
  void check_cut(const FrontSegment& segment) {
    const Bvtt bvtt(kept_.trees[number_of(segment.parts.a)].shape,
                    kept_.trees[number_of(segment.parts.b)].shape, segment.parts.a == segment.parts.b);
    std::size_t pairs = 0;
    std::vector<NodePair> stack{Bvtt::root()};
    for (const FrontChunk& chunk : segment.chunks) {
      pairs += chunk.pairs.size();
      for (const FrontPair& pair : chunk.pairs) {
        for (;;) {
          if (stack.empty() || stack.size() > kDeepest)
            return broken("the front" + of(segment) + " has pair " + text(pair.nodes) + " out of place");
          const NodePair at = stack.back();
          stack.pop_back();
          if (at == pair.nodes) break;
          if (bvtt.is_leaf(at)) return broken("the front" + of(segment) + " lacks pair " + text(at));
          const auto children = static_cast<std::ptrdiff_t>(stack.size());
          bvtt.for_children(at, [&](const NodePair& child) { stack.push_back(child); });
          std::reverse(stack.begin() + children, stack.end());
        }
      }
    }
    if (!stack.empty())
      return broken("the front" + of(segment) + " has no pairs below " + text(stack.back()));
    if (pairs != segment.size) broken("the front" + of(segment) + " has a wrong pair count");
  }

  void check_chunk(const FrontSegment& segment, const FrontChunk& chunk) {
    if (found_) return;
    kept_.stop.check();
    const TreePair<Bounds> trees(kept_.trees[number_of(segment.parts.a)],
                                 kept_.trees[number_of(segment.parts.b)], GapAt::kEnd,
                                 kept_.widths.of(segment.parts));
    const Bvtt bvtt = trees.bvtt();
    std::uint64_t tests = 0;
    for (const FrontPair& pair : chunk.pairs) {
      if (!bvtt.is_leaf(pair.nodes) && !(trees.gap(pair.nodes, tests) > 0))
        return broken("the front" + of(segment) + " marks overlapping pair " + text(pair.nodes) +
                      " as disjoint");
      if (pair.adjacent && trees.gap(pair.nodes, tests) > 0)
        return broken("the front" + of(segment) + " marks pair " + text(pair.nodes) + " as adjacent");
    }
    std::size_t contacts = 0;
    for (std::size_t i = 0; i < chunk.kept.pairs.size(); ++i) {
      contacts += chunk.kept.pairs[i].contacts;
      if (chunk.kept.pairs[i].pair >= chunk.pairs.size() ||
          (i > 0 && chunk.kept.pairs[i].pair <= chunk.kept.pairs[i - 1].pair))
        return broken("the front" + of(segment) + " caches answers of pairs that it does not contain");
    }
    if (contacts != chunk.kept.contacts.size())
      broken("the front" + of(segment) + " has a wrong count of cached contacts");
  }

  static constexpr std::size_t kNodesAtOnce = 64;

  // Two nodes of at most 31 levels, with two pending siblings at each.
  static constexpr std::size_t kDeepest = 192;

  const KeptState<Bounds>& kept_;
  const Core& core_;
  Finding found_;
};

}  // namespace

std::uint64_t checksum(const Core& core, StopSignal stop) {
  std::uint64_t sum = topology_checksum(*core.scene, *core.topology, stop);
  // Orphans of other parts may have been found for a change that was rolled back.
  for (std::size_t p = 0; p < core.orphans.size(); ++p) {
    if (core.orphans[p] != nullptr) sum += orphans_checksum(core.topology->parts[p], p, stop);
  }
  return sum;
}

template <class Bounds>
Status self_check(const KeptState<Bounds>& kept) {
  return SelfCheck<Bounds>(kept).run();
}
template Status self_check(const KeptState<Aabb>&);
template Status self_check(const KeptState<KDop18>&);

}  // namespace warmfront
