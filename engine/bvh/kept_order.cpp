// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/kept_order.h"

#include <algorithm>
#include <array>
#include <utility>

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

// The nearest of the blocks around one, itself first, of which something is true; their count for none.
template <class Holds>
std::uint32_t nearest(std::uint32_t block, std::uint32_t count, Holds&& holds) {
  for (std::uint32_t away = 0; away <= kReach; ++away) {
    if (block >= away && holds(block - away)) return block - away;
    if (block + away < count && holds(block + away)) return block + away;
  }
  return count;
}

// Some blocks that held primitives of a vertex.
class BlocksAround {
 public:
  void add(std::uint32_t block) {
    if (count_ < blocks_.size() && !holds(block)) blocks_[count_++] = block;
  }
  bool holds(std::uint32_t block) const { return std::ranges::find(blocks(), block) != blocks().end(); }
  std::span<const std::uint32_t> blocks() const { return std::span(blocks_).first(count_); }

 private:
  std::array<std::uint32_t, 6> blocks_{};
  std::size_t count_ = 0;
};

// Where something new belongs, by the blocks around its vertices: to one that held most of them; of these,
// where there is the most room, so that what comes fills what went. Else to one near by; the count of blocks
// for none.
std::uint32_t block_for(std::span<const BlocksAround* const> of_vertices, std::span<const Block> blocks,
                        std::uint32_t most) {
  const auto count = static_cast<std::uint32_t>(blocks.size());
  const auto has_room = [&](std::uint32_t b) { return blocks[b].count < most; };
  std::uint32_t best = count;
  std::uint32_t any = 0;
  std::ptrdiff_t vertices_of_best = 0;
  for (const BlocksAround* around : of_vertices) {
    for (const std::uint32_t b : around->blocks()) {
      any = b;
      if (!has_room(b)) continue;
      const auto vertices =
          std::ranges::count_if(of_vertices, [b](const BlocksAround* other) { return other->holds(b); });
      if (vertices < vertices_of_best) continue;
      if (vertices == vertices_of_best && blocks[b].count >= blocks[best].count) continue;
      vertices_of_best = vertices;
      best = b;
    }
  }
  return best != count ? best : nearest(any, count, has_room);
}

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
  bool for_others(const LocalChange& change, PacedStop& paced, Visit&& visit) const {
    for (std::uint32_t f = 0; f < change.face_before.size(); ++f) {
      paced.check();
      if (change.face_before[f] == LocalChange::kNone && !visit(primitive_of_face(f))) return false;
    }
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      paced.check();
      if (segments_[i] == 0 && !visit(primitive_of_edge(lone_edges(alone_)[i]))) return false;
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      paced.check();
      if (points_[i] == 0 && !visit(primitive_of_vertex(alone_.isolated_vertices()[i]))) return false;
    }
    return true;
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
  std::vector<Block> blocks;
  lengthen(blocks, count, Block{}, stop);
  std::vector<std::uint8_t> changed;
  lengthen(changed, count, std::uint8_t{0}, stop);
  // By vertex before, of those of which there may be new primitives: where it is in `around`.
  constexpr std::uint32_t kNotAsked = 0xffffffff;
  std::vector<std::uint32_t> asked;
  lengthen(asked, alone.vertex_count(), kNotAsked, stop);
  std::vector<BlocksAround> around;
  lengthen(around, change.at.size(), BlocksAround{}, stop);
  std::vector<std::uint32_t> block_of_face;  // before
  lengthen(block_of_face, part.face_count(), 0U, stop);
  Placing placing(alone, stop);
  PacedStop paced(stop);
  const auto given = [&](std::uint32_t v) {
    return number_of(numbering.given(NewVertex{v})) - part.features.first_vertex;
  };
  const auto before_of = [&](std::uint32_t v) {
    return number_of(numbering.renumbered(GivenVertex{v + part.features.first_vertex})) -
           part.features.first_vertex;
  };
  for (std::uint32_t i = 0; i < change.at.size(); ++i) asked[before_of(change.at[i])] = i;
  // The same primitive as given now, if there is one; faces only where they are left.
  const auto left_of = [&](Primitive p) {
    if (is_face(p)) {
      const std::uint32_t face =
          change.face_of[number_of(numbering.given(NewFace{face_number(p)})) - part.first_face];
      return face != LocalChange::kNone ? primitive_of_face(face) : kNoPrimitive;
    }
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
    const BlockId block{b};
    for (std::uint32_t i = shape.begin_of_block(block); i < shape.begin_of_block(block + 1); ++i) {
      paced.check();
      Held one{left_of(order[i])};
      if (is_gap(one)) changed[b] = 1;
      if (is_face(order[i])) {
        const std::uint32_t face = face_number(order[i]) - part.first_face;
        block_of_face[face] = b;
        if (!is_gap(one)) one.face_before = face;
      } else {
        for (const std::uint32_t v : primitive_vertices(before, order[i])) {
          const std::uint32_t at = asked[v - part.features.first_vertex];
          if (at != kNotAsked) around[at].add(b);
        }
      }
      blocks[b].put(one);
    }
  }
  for (std::uint32_t i = 0; i < change.at.size(); ++i) {
    const std::uint32_t v = before_of(change.at[i]) + part.features.first_vertex;
    for (const std::uint32_t f : before.vertex_faces()[v]) {
      paced.check();
      around[i].add(block_of_face[f - part.first_face]);
    }
  }
  const bool all_placed = placing.for_others(change, paced, [&](Primitive p) {
    std::array<const BlocksAround*, 3> of_vertices;
    const Face vertices = primitive_vertices(alone, p);
    for (std::size_t k = 0; k < 3; ++k) of_vertices[k] = &around[asked[before_of(vertices[k])]];
    const std::uint32_t block = block_for(of_vertices, blocks, most);
    if (block == count) return false;
    blocks[block].add({p});
    changed[block] = 1;
    return true;
  });
  if (!all_placed) return std::nullopt;
  for (std::uint32_t b = 0; b < count; ++b) {
    paced.check();
    if (blocks[b].count > 0) continue;
    const std::uint32_t from =
        nearest(b, count, [&](std::uint32_t other) { return blocks[other].count > 1; });
    if (from == count) return std::nullopt;
    // The one next to it, so that faces keep their order.
    blocks[b].add(from > b ? blocks[from].take_first() : blocks[from].take_last());
    changed[b] = changed[from] = 1;
  }
  KeptOrder kept;
  reserve(kept.order, primitives, stop);
  reserve(kept.face_before, alone.face_count(), stop);
  std::vector<std::uint32_t> begins;
  reserve(begins, std::size_t{count} + 1, stop);
  for (const Block& block : blocks) {
    paced.check();
    begins.push_back(static_cast<std::uint32_t>(kept.order.size()));
    for (std::uint32_t i = 0; i < block.size; ++i) {
      const Held& one = block.held[i];
      if (is_gap(one)) continue;
      kept.order.push_back(one.now);
      if (is_face(one.now)) kept.face_before.push_back(one.face_before);
    }
  }
  begins.push_back(static_cast<std::uint32_t>(kept.order.size()));
  kept.changed = std::move(changed);
  kept.shape = shape.with_blocks(std::move(begins));
  return kept;
}

}  // namespace warmfront
