// SPDX-License-Identifier: Apache-2.0
#include "engine/step/turning_stage.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

/// Where the arcs of two parts are longer than this share of the smaller one's radius, lines do not serve.
constexpr double kShareOfRadius = 0x1p-6;
/// Radians that a part turns by in a piece, at most; but no more than kMostPiecesOfStep pieces.
constexpr double kAngle = 0.2;

double angle_of(const Core& core, PartId part) {
  const Twist* twist = core.arcs.of_part(part);
  return twist == nullptr ? 0 : std::sqrt(twist->angle_squared);
}

std::span<const ChordBox> some(const std::vector<ChordBox>& boxes, std::uint32_t first, std::uint32_t end) {
  return {boxes.data() + first, boxes.data() + end};
}

// What is not a number is near, and what is apart by no more than squares can tell.
bool near_each_other(const ChordBox& a, const ChordBox& b, double room) {
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double apart = std::max({0.0, a.low[k] - b.high[k], b.low[k] - a.high[k]});
    if (apart > room) return false;
    square += apart * apart;
  }
  return !(square > room * room * (1 + 0x1p-40) + kTooSmall * kTooSmall);
}

}  // namespace

void TurningStage::take(const Core& core, std::span<const NearPair> near, StopSignal stop) {
  forget();
  part_count_ = 0;
  // Candidates are what whole arcs do not exclude.
  const ColliderOptions& options = core.options;
  if (!core.arcs.any() || options.pair_test != PairTest::kMotion || options.report == Report::kCandidates)
    return;
  const auto radius_of = [&](PartId part) {
    return core.motion.turns(part) ? core.motion.ball(part).radius : std::numeric_limits<double>::infinity();
  };
  double most = 0;
  PacedStop paced(stop);
  for (const NearPair& pair : near) {
    paced.check();
    const auto [a, b] = pair.parts;
    const double arcs = core.arcs.most_of(a) + core.arcs.most_of(b);
    const bool large =
        arcs > 0 && arcs > kShareOfRadius * std::min(radius_of(a), radius_of(b)) && std::isfinite(arcs);
    (large ? pairs_ : others_).push_back(pair);
    if (large) most = std::max({most, angle_of(core, a), angle_of(core, b)});
  }
  pieces_ = 2;
  while (pieces_ < kMostPiecesOfStep && most > kAngle * pieces_) pieces_ *= 2;
}

void TurningStage::take_met(const Core& core, StopSignal stop) {
  const auto index_of = [this](PartId part) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(named_, part) - named_.begin());
  };
  met_.clear();
  PacedStop paced(stop);
  for (const NearPair& pair : pairs_) {
    paced.check();
    const std::uint32_t i = index_of(pair.parts.a);
    const std::uint32_t j = index_of(pair.parts.b);
    const Part& a = parts_[i];
    const Part& b = parts_[j];
    const KeptRoom room = room_between(core, a, b);
    if (!(a.reach < kMostReach && b.reach < kMostReach) || near_each_other(a.ever, b.ever, room.most()))
      met_.push_back({i, j, room});
  }
}

// Its vertices' boxes hold all chords of a part in a piece, as the root's does, which is what holds those of
// its primitives: where these are apart, so are the roots.
bool TurningStage::are_near(const MetPair& pair, int piece) const {
  const Part& a = parts_[pair.a];
  const Part& b = parts_[pair.b];
  if (!(a.reach < kMostReach && b.reach < kMostReach)) return true;
  const auto k = static_cast<std::uint32_t>(piece);
  return near_each_other(around(some(a.at_times, k, k + 2)), around(some(b.at_times, k, k + 2)),
                         pair.room.differs() ? pair.room.of(a.at_times[0], b.at_times[0]) : pair.room.most());
}

void TurningStage::bound_above(const TreeShape& shape, Boxes& boxes, StopSignal stop) {
  const bool empty = boxes.primitives.empty();
  boxes.blocks.resize(empty ? 0 : shape.block_count());
  boxes.nodes.resize(empty ? 0 : shape.node_count());
  PacedStop paced(stop);
  for (std::uint32_t i = 0; i < boxes.blocks.size(); ++i) {
    const BlockId block{i};
    boxes.blocks[i] =
        around(some(boxes.primitives, shape.begin_of_block(block), shape.begin_of_block(block + 1)));
  }
  for (auto i = static_cast<std::uint32_t>(boxes.nodes.size()); i-- > 0;) {
    const NodeId node{i};
    paced.check();
    boxes.nodes[i] =
        shape.is_leaf(node)
            ? around(some(boxes.blocks, number_of(shape.first_block(node)), number_of(shape.end_block(node))))
            : around(
                  some(boxes.nodes, number_of(TreeShape::left(node)), number_of(TreeShape::right(node)) + 1));
  }
}

template <class Bounds>
void TurningStage::bound(const Core& core, const Bvh<Bounds>& tree, Part& part, int piece,
                         StopSignal stop) const {
  if (!part.near || (part.rests && part.bounded)) return;
  const bool first = !part.bounded;
  part.bounded = true;
  part.now.primitives.resize(tree.order.size());
  PacedStop paced(stop);
  const std::uint32_t first_vertex = core.motion.first_vertex(part.part);
  const std::uint32_t count = core.motion.vertex_count(part.part);
  if (part.corners.empty()) {
    for (const Primitive primitive : tree.order) {
      paced.check();
      const auto [a, b, c] = primitive_vertices(core.topology->scene, primitive);
      part.corners.push_back({static_cast<std::uint32_t>(a) - first_vertex,
                              static_cast<std::uint32_t>(b) - first_vertex,
                              static_cast<std::uint32_t>(c) - first_vertex});
    }
  }
  part.vertices.resize(count);
  if (first && core.keep.share > 0) {
    for (std::uint32_t v = 0; v < count; ++v) {
      paced.check();
      const Corner corner = position(core, part, v, 0);
      part.vertices[v] = {corner, corner};
    }
    part.start.primitives.resize(tree.order.size());
    around_primitives(part.vertices, part.corners, part.start.primitives.data());
    bound_above(tree.shape, part.start, stop);
  }
  const std::span<const Corner> at(part.at);
  if (!at.empty()) {
    around_chords(at.subspan(static_cast<std::size_t>(piece) * count, count),
                  at.subspan((static_cast<std::size_t>(piece) + 1) * count, count), part.vertices.data());
  } else {
    for (std::uint32_t v = 0; v < count; ++v) {
      paced.check();
      part.vertices[v] =
          around_points(std::array{position(core, part, v, piece), position(core, part, v, piece + 1)});
    }
  }
  around_primitives(part.vertices, part.corners, part.now.primitives.data());
  bound_above(tree.shape, part.now, stop);
}

template <class Bounds>
std::uint64_t TurningStage::traverse(const Core& core, std::span<const Bvh<Bounds>> trees,
                                     const MetPair& pair, int piece, PairTester& tester,
                                     StopSignal stop) const {
  const Part& a = parts_[pair.a];
  const Part& b = parts_[pair.b];
  if (!are_near(pair, piece)) return 1;  // as the roots say
  if (a.now.nodes.empty() || b.now.nodes.empty()) return 0;
  const Bvh<Bounds>& tree_a = trees[number_of(a.part)];
  const Bvh<Bounds>& tree_b = trees[number_of(b.part)];
  const TreeShape& of_a = tree_a.shape;
  const TreeShape& of_b = tree_b.shape;
  std::uint64_t tests = 0;
  PacedStop paced(stop);
  tester.begin_leaves(a.part, b.part);
  const KeptRoom& room = pair.room;
  // Of some of these boxes, by their places.
  const auto near = [&](std::vector<Box> Boxes::*of_x, std::uint32_t x, std::vector<Box> Boxes::*of_y,
                        std::uint32_t y) {
    const Box& box_x = (a.now.*of_x)[x];
    const Box& box_y = (b.now.*of_y)[y];
    if (!near_each_other(box_x, box_y, room.most())) return false;
    return !room.differs() || near_each_other(box_x, box_y, room.of((a.start.*of_x)[x], (b.start.*of_y)[y]));
  };
  constexpr auto kNodes = &Boxes::nodes;
  constexpr auto kBlocks = &Boxes::blocks;
  constexpr auto kPrimitives = &Boxes::primitives;
  // Were they, by their places, tested in a piece before? Most that were are near in the last one, too.
  const auto tested = [&](std::uint32_t i, std::uint32_t j, double own) {
    for (int k = piece; k-- > 0;) {
      if (near_each_other(box_of(core, a, a.corners[i], k), box_of(core, b, b.corners[j], k), own))
        return true;
    }
    return false;
  };
  const auto test = [&](std::uint32_t i, std::uint32_t j) {
    const Primitive x = tree_a.order[i];
    const Primitive y = tree_b.order[j];
    const double own = room_of(core, a, i, b, j, room);
    if (room.differs() && !near_each_other(a.now.primitives[i], b.now.primitives[j], own)) return;
    if (tested(i, j, own)) return;
    if (!are_faces(x, y)) return tester.primitive_pair(x, y);
    const double latest = tester.earliest();
    const std::uint32_t features = x < y ? near_features_of(core, a, i, b, j, piece, latest, own)
                                         : near_features_of(core, b, j, a, i, piece, latest, own);
    if (features != 0) tester.primitive_pair(x, y, features);
  };
  const auto blocks = [&](BlockId block_a, BlockId block_b) {
    for (std::uint32_t i = of_a.begin_of_block(block_a); i < of_a.begin_of_block(block_a + 1); ++i) {
      if (!near(kPrimitives, i, kBlocks, number_of(block_b))) continue;
      for (std::uint32_t j = of_b.begin_of_block(block_b); j < of_b.begin_of_block(block_b + 1); ++j) {
        if (!near(kPrimitives, i, kPrimitives, j)) continue;
        paced.check();
        test(i, j);
      }
    }
  };
  // A pair of nodes is opened on the side that is the less deep; the stack holds a pair a level of both.
  std::array<std::pair<NodeId, NodeId>, 128> stack;
  std::size_t waiting = 0;
  stack[waiting++] = {kRoot, kRoot};
  while (waiting > 0) {
    paced.check();
    const auto [m, n] = stack[--waiting];
    ++tests;
    if (!near(kNodes, number_of(m), kNodes, number_of(n))) continue;
    const bool leaf_a = of_a.is_leaf(m);
    const bool leaf_b = of_b.is_leaf(n);
    if (leaf_a && leaf_b) {
      for (BlockId i = of_a.first_block(m); i < of_a.end_block(m); ++i) {
        if (!near(kBlocks, number_of(i), kNodes, number_of(n))) continue;
        for (BlockId j = of_b.first_block(n); j < of_b.end_block(n); ++j) {
          if (near(kBlocks, number_of(i), kBlocks, number_of(j))) blocks(i, j);
        }
      }
    } else if (!leaf_a && (leaf_b || TreeShape::level_of(m) <= TreeShape::level_of(n))) {
      stack[waiting++] = {TreeShape::left(m), n};
      stack[waiting++] = {TreeShape::right(m), n};
    } else {
      stack[waiting++] = {m, TreeShape::left(n)};
      stack[waiting++] = {m, TreeShape::right(n)};
    }
  }
  return tests;
}

template <class Bounds>
std::uint64_t TurningStage::run(const Core& core, std::span<const Bvh<Bounds>> trees,
                                NarrowPhase<Bounds>& narrow, StopSignal stop) {
  if (pairs_.empty()) return 0;
  const auto take = [&](PartId part) {
    if (part_count_ == parts_.size()) parts_.emplace_back();
    parts_[part_count_++].part = part;
  };
  named_.clear();
  for (const NearPair& pair : pairs_) named_.insert(named_.end(), {pair.parts.a, pair.parts.b});
  std::ranges::sort(named_);
  named_.erase(std::unique(named_.begin(), named_.end()), named_.end());
  for (const PartId part : named_) take(part);
  share_room(core);
  for_each_index(
      0, part_count_, stop, [&](std::size_t i) { place(core, parts_[i], stop); }, 1);
  take_met(core, stop);
  std::atomic<std::uint64_t> tests = pairs_.size() - met_.size();
  PacedStop paced(stop);
  for (int piece = 0; piece < pieces_; ++piece) {
    for (std::size_t i = 0; i < part_count_; ++i) parts_[i].near = false;
    PairTester& tester = narrow.tester();
    std::erase_if(met_, [&](const MetPair& pair) {
      paced.check();
      tester.begin_leaves(parts_[pair.a].part, parts_[pair.b].part);
      return time_of(static_cast<std::size_t>(piece)) > tester.earliest();
    });
    for (const MetPair& pair : met_) {
      paced.check();
      if (are_near(pair, piece)) parts_[pair.a].near = parts_[pair.b].near = true;
    }
    for_each_index(
        0, part_count_, stop,
        [&](std::size_t i) { bound(core, trees[number_of(parts_[i].part)], parts_[i], piece, stop); }, 1);
    for_each_index(
        0, met_.size(), stop,
        [&](std::size_t i) { tests += traverse(core, trees, met_[i], piece, narrow.tester(), stop); }, 1);
    if (core.options.report == Report::kEarliest) narrow.flush();  // so that all of it is known from here on
  }
  return tests;
}

template std::uint64_t TurningStage::run(const Core&, std::span<const Bvh<Aabb>>, NarrowPhase<Aabb>&,
                                         StopSignal);
template std::uint64_t TurningStage::run(const Core&, std::span<const Bvh<KDop18>>, NarrowPhase<KDop18>&,
                                         StopSignal);

std::size_t TurningStage::memory_bytes() const {
  std::size_t bytes = held_bytes(pairs_, others_, met_, named_, parts_);
  for (const Part& part : parts_)
    bytes += held_bytes(part.at, part.at_times, part.corners, part.vertices, part.now.nodes, part.now.blocks,
                        part.now.primitives, part.start.nodes, part.start.blocks, part.start.primitives);
  return bytes;
}

}  // namespace warmfront
