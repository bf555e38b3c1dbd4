// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/bvh.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "engine/parallel/join_pieces.h"

namespace warmfront {
namespace {

// Resizes; the elements' values are unspecified.
template <class List>
void make_room(List& list, std::size_t size, StopSignal stop) {
  if (list.size() > size) list.resize(size);
  lengthen(list, size, {}, stop);
}

template <class List>
void begin_anew(List& list, std::size_t size, StopSignal stop) {
  list.clear();
  lengthen(list, size, {}, stop);
}

UnwrittenList<Primitive> copy_of(std::span<const Primitive> order, StopSignal stop) {
  constexpr std::size_t kPiece = std::size_t{1} << 13;
  UnwrittenList<Primitive> copy;
  make_room(copy, order.size());
  const auto copy_piece = [&](std::size_t begin, std::size_t end) {
    std::ranges::copy(order.subspan(begin, end - begin), copy.begin() + static_cast<std::ptrdiff_t>(begin));
  };
  if (order.size() <= kPiece)
    copy_piece(0, order.size());
  else
    for_pieces(0, order.size(), kPiece, stop, copy_piece);
  return copy;
}

// By node: does it hold one of these blocks?
std::vector<std::uint8_t> holders_of(std::span<const std::uint8_t> blocks, const TreeShape& shape,
                                     StopSignal stop) {
  std::vector<std::uint8_t> holds;
  lengthen(holds, shape.node_count(), std::uint8_t{0}, stop);
  for (NodeId node = shape.first_leaf(); node < shape.end_node(); ++node) {
    for (BlockId b = shape.first_block(node); b < shape.end_block(node); ++b)
      holds[number_of(node)] |= blocks[number_of(b)];
  }
  for (std::uint32_t node = number_of(shape.first_leaf()); node-- > 0;)
    holds[node] =
        holds[number_of(TreeShape::left(NodeId{node}))] | holds[number_of(TreeShape::right(NodeId{node}))];
  return holds;
}

}  // namespace

template <class Bounds>
void Bvh<Bounds>::list_corners(const Scene& scene, BlockId block) {
  const std::uint32_t begin = shape.begin_of_block(block);
  const std::uint32_t size = shape.size_of_block(block);
  for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
    const Face vertices = primitive_vertices(scene, order[begin + (i < size ? i : 0)]);
    for (int corner = 0; corner < 3; ++corner)
      leaves.corners[number_of(block)].vertex[corner][i] = vertices[corner];
  }
  if (!travel.first_corners.empty())
    travel.first_corners[number_of(block)] = first_corners(leaves.corners[number_of(block)]);
}

template <class Bounds>
void Bvh<Bounds>::list_leaves(const Listed* before, StopSignal stop) {
  struct Range {
    std::uint32_t first = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t end = 0;
  };
  using Ranges = std::array<Range, 2>;  // faces, segments
  const auto ranges_of = [&](std::size_t first, std::size_t end) {
    Ranges ranges;
    // Most often all are faces, and there is nothing to decide for each.
    std::uint32_t all = 0, least = std::numeric_limits<std::uint32_t>::max(), most = 0;
    for (std::size_t i = first; i < end; ++i) {
      const auto p = static_cast<std::uint32_t>(order[i]);
      all |= p;
      least = std::min(least, p);
      most = std::max(most, p);
    }
    if (is_face(Primitive{all})) {
      if (end > first) ranges[0] = {least, most + 1};
      return ranges;
    }
    for (std::size_t i = first; i < end; ++i) {
      const Primitive p = order[i];
      if (is_point(p)) continue;
      Range& range = ranges[is_face(p) ? 0 : 1];
      range.first = std::min(range.first, number_in_kind(p));
      range.end = std::max(range.end, number_in_kind(p) + 1);
    }
    return ranges;
  };
  const auto widen = [](Ranges& all, const Ranges& piece) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].first = std::min(all[k].first, piece[k].first);
      all[k].end = std::max(all[k].end, piece[k].end);
    }
  };
  const Ranges ranges = join_pieces(0, order.size(), stop, Ranges{}, ranges_of, widen);
  bool same = before != nullptr && before->shape.node_count() == shape.node_count();
  const auto make_leaves = [&]<class Id>(LeavesOf<Id>& leaves_of, const Range& range) {
    const Id first{range.end > 0 ? range.first : 0};
    same &= leaves_of.first == first && leaves_of.leaf.size() == Id{range.end} - first;
    leaves_of.first = first;
    make_room(leaves_of.leaf, Id{range.end} - leaves_of.first, stop);
  };
  make_leaves(face_leaves, ranges[0]);
  make_leaves(segment_leaves, ranges[1]);
  stop.check();
  if (order.empty()) return;
  const auto list_leaf = [&](std::size_t leaf) {
    const NodeId node = shape.first_leaf() + static_cast<std::uint32_t>(leaf);
    const auto held_in = [node](const TreeShape& in, std::span<const Primitive> all) {
      return all.subspan(in.begin(node), in.end(node) - in.begin(node));
    };
    if (same && std::ranges::equal(held_in(shape, order), held_in(before->shape, before->order))) return;
    for (std::uint32_t i = shape.begin(node); i < shape.end(node); ++i) {
      const Primitive p = order[i];
      if (is_face(p))
        face_leaves.leaf[NewFace{face_number(p)} - face_leaves.first] = node;
      else if (is_segment(p))
        segment_leaves.leaf[edge_id(p) - segment_leaves.first] = node;
    }
  };
  for_each_index(0, shape.end_node() - shape.first_leaf(), stop, list_leaf, 512);
}

template <class Bounds>
void Bvh<Bounds>::arrange(const Scene& scene, const TreeShape& new_shape,
                          std::span<const Primitive> new_order,
                          std::shared_ptr<const SharedVertices> new_shared, bool keep_travel,
                          StopSignal stop) {
  shape = new_shape;
  order = copy_of(new_order, stop);
  leaves.shared = std::move(new_shared);
  built_looseness = 0;
  const bool wide = shape.has_wide_leaves() && !order.empty();
  const bool in_blocks = shape.leaf_size() != 1 && !order.empty();
  const std::size_t node_count = order.empty() ? 0 : shape.node_count();
  constexpr std::size_t kFew = 4096;
  const auto make_all = [this](const auto&... lists) {
    if (order.size() > kFew)
      fork_all(ForkPlace::here(), lists...);
    else
      (lists(), ...);
  };
  // Refit writes these, and list_corners().
  make_room(nodes, node_count);
  make_room(leaves.blocks, in_blocks ? shape.block_count() : 0);
  make_room(leaves.corners, in_blocks ? shape.block_count() : 0);
  make_room(leaves.wide, wide ? shape.leaf_count() : 0);
  make_room(travel.first_corners, in_blocks && keep_travel ? shape.block_count() : 0);
  // The system maps what is new page by page as it is touched: a list each.
  make_all(
      [&] {
        begin_anew(motion.states, node_count, stop);
        motion.renewed = {};
        begin_anew(travel.nodes, keep_travel ? node_count : 0, stop);
      },
      [&] {
        begin_anew(travel.blocks, keep_travel && shape.has_wide_leaves() ? shape.block_count() : 0, stop);
      },
      [&] { begin_anew(leaves.grids, in_blocks ? shape.leaf_count() : 0, stop); },
      [&] { list_leaves(nullptr, stop); });
  leaves.blocks_of.clear();
  if (leaves.blocks.empty()) return;
  make_all(
      [&] {
        leaves.blocks_of.reserve(shape.leaf_count());
        for (NodeId leaf = shape.first_leaf(); leaf < shape.end_node(); ++leaf)
          leaves.blocks_of.push_back({shape.first_block(leaf), shape.end_block(leaf)});
      },
      [&] {
        const auto list = [&](std::size_t b) { list_corners(scene, BlockId{static_cast<std::uint32_t>(b)}); };
        for_each_index(0, shape.block_count(), stop, list, 256);
      });
}

template <class Bounds>
void Bvh<Bounds>::change(const Scene& scene, const TreeShape& new_shape, std::span<const Primitive> new_order,
                         std::shared_ptr<const SharedVertices> new_shared,
                         std::span<const std::uint8_t> changed_blocks, StopSignal stop) {
  UnwrittenList<Primitive> copied = copy_of(new_order, stop);
  const TreeShape shape_before = std::exchange(shape, new_shape);
  const UnwrittenList<Primitive> order_before = std::exchange(order, std::move(copied));
  leaves.shared = std::move(new_shared);
  const Listed listed{shape_before, order_before};
  list_leaves(&listed, stop);
  // Of an earlier change, too, of which no refit has come to its end.
  std::vector<std::uint8_t> renewed = holders_of(changed_blocks, shape, stop);
  for (std::size_t node = 0; node < motion.renewed.size(); ++node) renewed[node] |= motion.renewed[node];
  motion.renewed = std::move(renewed);
  PacedStop paced(stop, 256);
  for (std::uint32_t b = 0; b < changed_blocks.size() && !leaves.corners.empty(); ++b) {
    if (changed_blocks[b] == 0) continue;
    paced.check();
    list_corners(scene, BlockId{b});
  }
}

template <class Bounds>
void Bvh<Bounds>::shift(const NumberShift& by) noexcept {
  if (!by.any()) return;
  for (Primitive& primitive : order) primitive = shifted(primitive, by);
  if (!face_leaves.leaf.empty()) face_leaves.first += by.face;
  if (!segment_leaves.leaf.empty()) segment_leaves.first += by.edge;
  if (by.vertex == 0) return;
  for (EightCorners& block : leaves.corners) {
    for (auto& corner : block.vertex) {
      for (std::uint32_t& vertex : corner) vertex += by.vertex;
    }
  }
}

// Piece by piece, so that the sum is the same for any number of threads.
template <class Bounds>
double looseness(const Bvh<Bounds>& bvh, bool alone) {
  constexpr std::size_t kPieces = 32, kFew = 1024;
  if (bvh.nodes.empty()) return 0;
  const std::size_t inner = number_of(bvh.shape.first_leaf());
  std::array<double, kPieces> sums{};
  const auto add = [&](std::size_t piece) {
    const std::span<const Bounds> nodes = std::span(bvh.nodes).first((piece + 1) * inner / kPieces);
    for (const Bounds& node : nodes.subspan(piece * inner / kPieces)) sums[piece] += node.extent();
  };
  if (alone || inner < kFew)
    for (std::size_t piece = 0; piece < kPieces; ++piece) add(piece);
  else
    fork_each(std::size_t{0}, kPieces, add);
  const double root = bvh.nodes.front().extent();
  return root > 0 ? std::accumulate(sums.begin(), sums.end(), 0.0) / root : 0;
}

template void Bvh<Aabb>::arrange(const Scene&, const TreeShape&, std::span<const Primitive>,
                                 std::shared_ptr<const SharedVertices>, bool, StopSignal);
template void Bvh<KDop18>::arrange(const Scene&, const TreeShape&, std::span<const Primitive>,
                                   std::shared_ptr<const SharedVertices>, bool, StopSignal);
template void Bvh<Aabb>::change(const Scene&, const TreeShape&, std::span<const Primitive>,
                                std::shared_ptr<const SharedVertices>, std::span<const std::uint8_t>,
                                StopSignal);
template void Bvh<KDop18>::change(const Scene&, const TreeShape&, std::span<const Primitive>,
                                  std::shared_ptr<const SharedVertices>, std::span<const std::uint8_t>,
                                  StopSignal);
template void Bvh<Aabb>::shift(const NumberShift&) noexcept;
template void Bvh<KDop18>::shift(const NumberShift&) noexcept;
template double looseness(const Bvh<Aabb>&, bool);
template double looseness(const Bvh<KDop18>&, bool);

}  // namespace warmfront
