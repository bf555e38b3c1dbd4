// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/kept_order.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/bvh/fill_blocks.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

constexpr Primitive kNoPrimitive{0xffffffff};

// What is gone leaves a gap, which the next one fills: so most others keep their places, and their numbers.
struct Held {
  Primitive now = kNoPrimitive;                    // as given
  std::uint32_t face_before = LocalChange::kNone;  // renumbered, of a face that stays
};
bool is_gap(const Held& held) {
  return held.now == kNoPrimitive;
}
struct Block {
  std::array<Held, TreeShape::kBlockSize> held;
  std::uint32_t count = 0;
  std::uint32_t size = 0;  // with gaps

  void put(Held one) {  // or a gap
    held[size++] = one;
    count += is_gap(one) ? 0 : 1;
  }
  void add(Held one) {
    if (count == size) return put(one);
    *std::find_if(held.begin(), held.begin() + size, is_gap) = one;
    ++count;
  }
  Held take_first() {
    Held& first = *std::find_if_not(held.begin(), held.begin() + size, is_gap);
    --count;
    return std::exchange(first, Held{});
  }
  Held take_last() {
    while (is_gap(held[size - 1])) --size;
    --count;
    return held[--size];
  }
};

// A hierarchy's blocks, of which few are opened: those in which something went or came.
class Blocks {
 public:
  Blocks(const HeldOrder& held, std::uint32_t first_face, StopSignal stop)
      : held_(held), first_face_(first_face) {
    lengthen(left_, held.order.size(), kNoPrimitive, stop);
    lengthen(opened_, count(), kClosed, stop);
  }
  std::uint32_t count() const { return held_.shape.block_count(); }
  // How many primitives one holds.
  std::uint32_t size(std::uint32_t b) const {
    return opened_[b] == kClosed ? size_before(b) : open_[opened_[b]].count;
  }

  // By block, when those in which something went are open.
  std::vector<BlockRoom> rooms(std::uint32_t most) const {
    std::vector<BlockRoom> rooms(count());
    for (std::uint32_t b = 0; b < count(); ++b) rooms[b] = {size_before(b) - size(b), most - size(b)};
    return rooms;
  }

  // What was in this position of the order, as given now; kNoPrimitive: it is gone. Before its block is
  // opened.
  void leave(std::uint32_t position, Primitive now) { left_[position] = now; }
  // What it refers to is elsewhere once another block was opened for the first time.
  Block& open(std::uint32_t b) {
    if (opened_[b] == kClosed) {
      opened_[b] = static_cast<std::uint32_t>(open_.size());
      Block& block = open_.emplace_back();
      for (std::uint32_t i = begin(b); i < begin(b + 1); ++i)
        block.put(
            {left_[i], left_[i] != kNoPrimitive && is_face(left_[i]) ? face_before(i) : LocalChange::kNone});
    }
    return open_[opened_[b]];
  }

  // All that they hold.
  KeptOrder order(std::size_t primitives, std::size_t faces, StopSignal stop) const {
    KeptOrder kept;
    reserve(kept.order, primitives, stop);
    reserve(kept.face_before, faces, stop);
    lengthen(kept.changed, count(), std::uint8_t{0}, stop);
    std::vector<std::uint32_t> begins;
    reserve(begins, std::size_t{count()} + 1, stop);
    PacedStop paced(stop, 256);
    for (std::uint32_t b = 0; b < count(); ++b) {
      paced.check();
      begins.push_back(static_cast<std::uint32_t>(kept.order.size()));
      if (opened_[b] == kClosed) {
        for (std::uint32_t i = begin(b); i < begin(b + 1); ++i) {
          kept.order.push_back(left_[i]);
          if (is_face(left_[i])) kept.face_before.push_back(face_before(i));
        }
        continue;
      }
      kept.changed[b] = 1;
      const Block& block = open_[opened_[b]];
      for (const Held& one : std::span(block.held).first(block.size)) {
        if (is_gap(one)) continue;
        kept.order.push_back(one.now);
        if (is_face(one.now)) kept.face_before.push_back(one.face_before);
      }
    }
    begins.push_back(static_cast<std::uint32_t>(kept.order.size()));
    kept.shape = held_.shape.with_blocks(std::move(begins));
    return kept;
  }

 private:
  static constexpr std::uint32_t kClosed = 0xffffffff;

  std::uint32_t size_before(std::uint32_t b) const { return held_.shape.size_of_block(BlockId{b}); }
  std::uint32_t begin(std::uint32_t b) const { return held_.shape.begin_of_block(BlockId{b}); }
  std::uint32_t face_before(std::uint32_t position) const {
    return face_number(held_.order[position]) - first_face_;
  }

  const HeldOrder& held_;
  const std::uint32_t first_face_;
  std::vector<Primitive> left_;        // by position
  std::vector<std::uint32_t> opened_;  // by block: where in open_
  std::vector<Block> open_;
};

// Which primitives of a body there are, and which of them have a place.
class Placing {
 public:
  Placing(const Scene& alone, StopSignal stop) : alone_(alone) {
    lengthen(segments_, alone.lone_edges().size(), std::uint8_t{0}, stop);
    lengthen(points_, alone.isolated_vertices().size(), std::uint8_t{0}, stop);
  }
  // Is there such a primitive, not a face? It has a place now.
  bool place(Primitive p) {
    auto& list = is_segment(p) ? segments_ : points_;
    const std::span<const std::uint32_t> numbers =
        is_segment(p) ? alone_.lone_edges() : alone_.isolated_vertices();
    const auto at = std::ranges::lower_bound(numbers, number_in_kind(p));
    if (at == numbers.end() || *at != number_in_kind(p)) return false;
    list[static_cast<std::size_t>(at - numbers.begin())] = 1;
    return true;
  }
  // Those without.
  template <class Visit>
  void for_others(const LocalChange& change, PacedStop& paced, Visit&& visit) const {
    for (const std::uint32_t f : change.came) {
      paced.check();
      visit(primitive_of_face(f));
    }
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      paced.check();
      if (segments_[i] == 0) visit(primitive_of_edge(lone_edges(alone_)[i]));
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      paced.check();
      if (points_[i] == 0) visit(primitive_of_vertex(alone_.isolated_vertices()[i]));
    }
  }

 private:
  const Scene& alone_;
  std::vector<std::uint8_t> segments_;
  std::vector<std::uint8_t> points_;
};

}  // namespace

std::optional<KeptOrder> keep_order(const HeldOrder& held, const Scene& before, const Renumbering& numbering,
                                    const MeshRange& part, const Scene& alone, const LocalChange& change,
                                    StopSignal stop) {
  const TreeShape& shape = held.shape;
  const std::span<const Primitive> order = held.order;
  const std::size_t primitives = alone.element_count() + alone.isolated_vertices().size();
  const std::uint32_t most = TreeShape::most_of_block(shape.leaf_size());
  const std::uint32_t count = shape.block_count();
  const std::size_t room = std::size_t{most} * count;
  if (order.empty() || primitives > room || 2 * primitives < room) return std::nullopt;
  Blocks blocks(held, part.first_face, stop);
  // By vertex before, of those of which there may be new primitives: where it is in `around`.
  constexpr std::uint32_t kNotAsked = 0xffffffff;
  std::vector<std::uint32_t> asked;
  lengthen(asked, alone.vertex_count(), kNotAsked, stop);
  std::vector<BlocksAround> around;
  lengthen(around, change.at.size(), BlocksAround{}, stop);
  std::vector<std::uint32_t> block_of_face;  // before
  lengthen(block_of_face, part.face_count(), 0U, stop);
  Placing placing(alone, stop);
  PacedStop paced(stop, 256);
  const auto given = [&](std::uint32_t v) {
    return number_of(numbering.given(NewVertex{v})) - part.features.first_vertex;
  };
  const auto before_of = [&](std::uint32_t v) {
    return number_of(numbering.renumbered(GivenVertex{v + part.features.first_vertex})) -
           part.features.first_vertex;
  };
  for (std::uint32_t i = 0; i < change.at.size(); ++i) asked[before_of(change.at[i])] = i;
  // The same primitive as given now, if there is one; faces only where they are left.
  const auto left_of_face = [&](Primitive face) {
    const std::uint32_t now =
        change.face_of[number_of(numbering.given(NewFace{face_number(face)})) - part.first_face];
    return now != LocalChange::kNone ? primitive_of_face(now) : kNoPrimitive;
  };
  const auto left_of_other = [&](Primitive p) {
    Primitive now = kNoPrimitive;
    if (is_point(p)) {
      now = primitive_of_vertex(given(vertex_number(p)));
    } else {
      const EdgeId edge = change.edge_of[edge_id(p) - part.features.first_edge];
      if (edge != LocalChange::kNoEdge) now = primitive_of_edge(edge);
    }
    return now != kNoPrimitive && placing.place(now) ? now : kNoPrimitive;
  };
  for (std::uint32_t b = 0; b < count; ++b) {
    paced.check();
    const std::uint32_t end = shape.begin_of_block(BlockId{b} + 1);
    bool went = false;
    for (std::uint32_t i = shape.begin_of_block(BlockId{b}); i < end; ++i) {
      Primitive left;
      if (is_face(order[i])) {
        left = left_of_face(order[i]);
        block_of_face[face_number(order[i]) - part.first_face] = b;
      } else {
        left = left_of_other(order[i]);
        for (const std::uint32_t v : primitive_vertices(before, order[i])) {
          const std::uint32_t at = asked[v - part.features.first_vertex];
          if (at != kNotAsked) around[at].add(b);
        }
      }
      blocks.leave(i, left);
      went |= left == kNoPrimitive;
    }
    if (went) blocks.open(b);
  }
  for (std::uint32_t i = 0; i < change.at.size(); ++i) {
    const std::uint32_t v = before_of(change.at[i]) + part.features.first_vertex;
    for (const std::uint32_t f : before.vertex_faces()[v]) {
      paced.check();
      around[i].add(block_of_face[f - part.first_face]);
    }
  }
  std::vector<Primitive> others;
  std::vector<Newcomer> newcomers;
  placing.for_others(change, paced, [&](Primitive p) {
    others.push_back(p);
    Newcomer& newcomer = newcomers.emplace_back();
    const Face vertices = primitive_vertices(alone, p);
    for (std::size_t k = 0; k < 3; ++k) newcomer[k] = &around[asked[before_of(vertices[k])]];
  });
  const std::vector<std::uint32_t> block_of = fill_blocks(newcomers, blocks.rooms(most), stop);
  if (block_of.size() != others.size()) return std::nullopt;
  for (std::size_t i = 0; i < others.size(); ++i) {
    paced.check();
    blocks.open(block_of[i]).add({others[i]});
  }
  for (std::uint32_t b = 0; b < count; ++b) {
    paced.check();
    if (blocks.size(b) > 0) continue;
    const std::uint32_t from =
        nearest_block(b, count, [&](std::uint32_t other) { return blocks.size(other) > 1; });
    if (from == count) return std::nullopt;
    blocks.open(from);
    Block& empty = blocks.open(b);
    // The one next to it, so that faces keep their order.
    empty.add(from > b ? blocks.open(from).take_first() : blocks.open(from).take_last());
  }
  return blocks.order(primitives, alone.face_count(), stop);
}

}  // namespace warmfront
