// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/shared_vertices.h"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
namespace {

constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

/// Position of each of a range of faces, or of lone edges: kBlockSize times the block, plus the slot.
template <Number Id>
class PlacesOf {
 public:
  void widen(Id id) {
    first_ = std::min(first_, id);
    end_ = std::max(end_, id + 1);
  }
  /// After all widen().
  void make_room(StopSignal stop) {
    if (end_ > first_) lengthen(place_, end_ - first_, kNowhere, stop);
  }
  std::uint32_t& of(Id id) { return place_[id - first_]; }
  std::uint32_t of(Id id) const { return place_[id - first_]; }

 private:
  Id first_{kNowhere};
  Id end_{0};
  std::vector<std::uint32_t> place_;
};

// Bit i of eight becomes bit 8 i.
std::uint64_t spread(std::uint64_t bits) {
  constexpr std::uint64_t kEach = 0x0101010101010101;
  constexpr std::uint64_t kDiagonal = 0x8040201008040201;
  const std::uint64_t one_a_byte = (bits * kEach) & kDiagonal;
  return ((one_a_byte | (one_a_byte + 0x7f * kEach)) >> 7) & kEach;
}

// Is the row, or vertex, one of those marked? All are where none is.
bool is_marked(std::span<const std::uint8_t> marks, std::size_t at) {
  return marks.empty() || marks[at] != 0;
}

}  // namespace

/// And their vertices' range.
class SharedVertices::Places {
 public:
  struct AllOf {};  // the scene

  std::uint32_t first_vertex = kNowhere;
  std::uint32_t end_vertex = 0;
  PlacesOf<NewFace> faces;
  PlacesOf<EdgeId> segments;

  Places(const Scene& scene, std::span<const std::span<const Primitive>> blocks, StopSignal stop) {
    PacedStop paced(stop);
    for_each(blocks, [&](Primitive p, std::uint32_t) {
      paced.check();
      of_kind(p, [](auto& places, auto id) { places.widen(id); });
      for (const std::uint32_t v : primitive_vertices(scene, p)) {
        first_vertex = std::min(first_vertex, v);
        end_vertex = std::max(end_vertex, v + 1);
      }
    });
    faces.make_room(stop);
    segments.make_room(stop);
    put(blocks, stop);
  }
  // Of all primitives of a scene.
  Places(const Scene& scene, std::span<const std::span<const Primitive>> blocks, AllOf /*of*/,
         StopSignal stop)
      : first_vertex(0), end_vertex(scene.vertex_count()) {
    if (scene.face_count() > 0) {
      faces.widen(NewFace{0});
      faces.widen(NewFace{scene.face_count() - 1});
    }
    for (const EdgeId e : lone_edges(scene)) segments.widen(e);
    faces.make_room(stop);
    segments.make_room(stop);
    put(blocks, stop);
  }

 private:
  void put(std::span<const std::span<const Primitive>> blocks, StopSignal stop) {
    PacedStop paced(stop);
    for_each(blocks, [&](Primitive p, std::uint32_t at) {
      paced.check();
      of_kind(p, [at](auto& places, auto id) { places.of(id) = at; });
    });
  }
  template <class Visit>
  void of_kind(Primitive p, Visit&& visit) {
    if (is_face(p))
      visit(faces, NewFace{face_number(p)});
    else
      visit(segments, edge_id(p));
  }

  // Points share no vertex.
  template <class Visit>
  static void for_each(std::span<const std::span<const Primitive>> blocks, Visit&& visit) {
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      for (std::uint32_t slot = 0; slot < blocks[b].size(); ++slot) {
        if (!is_point(blocks[b][slot])) visit(blocks[b][slot], SharedVertices::kBlockSize * b + slot);
      }
    }
  }
};

SharedVertices::SharedVertices(const Scene& scene, std::span<const std::span<const Primitive>> blocks,
                               StopSignal stop) {
  lengthen(others_, kRow * blocks.size(), kNone, stop);
  lengthen(pairs_, kRow * blocks.size(), {}, stop);
  for (std::size_t b = 0; b < blocks.size(); ++b) others_[kRow * b] = static_cast<std::uint32_t>(b);
  const Places places(scene, blocks, stop);
  stop.check();
  PacedStop paced(stop, 256);
  for (std::uint32_t v = places.first_vertex; v < places.end_vertex; ++v) {
    paced.check();
    list_vertex(scene, places, v, {});
  }
  finish(blocks, {});
}

// Rows are made anew of blocks that changed, and of those that share a vertex with one: by all vertices of
// these.
SharedVertices::SharedVertices(const Scene& scene, std::span<const std::span<const Primitive>> blocks,
                               const SharedVertices& before, std::span<const std::uint8_t> changed,
                               StopSignal stop) {
  append(others_, std::span(before.others_), stop);
  append(pairs_, std::span(before.pairs_), stop);
  std::vector<std::uint8_t> rows(changed.begin(), changed.end());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t place = kRow * b; place < kRow * (b + 1) && others_[place] != kNone; ++place)
      rows[b] |= changed[others_[place]];
  }
  for (const More& more : before.more_) {
    if (changed[more.other] != 0) rows[more.owner] = 1;
  }
  const Places places(scene, blocks, Places::AllOf{}, stop);
  std::vector<std::uint8_t> marked;  // by vertex
  lengthen(marked, scene.vertex_count(), std::uint8_t{0}, stop);
  std::vector<std::uint32_t> vertices;
  PacedStop paced(stop, 256);
  const auto mark_vertices = [&](std::size_t b) {
    for (const Primitive p : blocks[b]) {
      if (is_point(p)) continue;  // these share no vertex
      for (const std::uint32_t v : primitive_vertices(scene, p)) {
        if (std::exchange(marked[v], std::uint8_t{1}) == 0) vertices.push_back(v);
      }
    }
  };
  // What is in a block now shares vertices with blocks that did not list it before.
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    paced.check();
    if (changed[b] != 0) mark_vertices(b);
  }
  for (const std::uint32_t v : vertices) {
    for (const std::uint32_t f : scene.vertex_faces()[v]) {
      paced.check();
      rows[places.faces.of(NewFace{f}) / kBlockSize] = 1;
    }
    for (const EdgeId e : lone_edges_of(scene, v)) {
      paced.check();
      rows[places.segments.of(e) / kBlockSize] = 1;
    }
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    paced.check();
    if (rows[b] == 0) continue;
    mark_vertices(b);
    std::fill_n(others_.begin() + static_cast<std::ptrdiff_t>(kRow * b), kRow, kNone);
    std::fill_n(pairs_.begin() + static_cast<std::ptrdiff_t>(kRow * b), kRow, 0);
    others_[kRow * b] = static_cast<std::uint32_t>(b);
  }
  // Rows list in the order of vertices, as all of these would.
  std::ranges::sort(vertices);
  for (const More& more : before.more_) {
    if (rows[more.owner] == 0) more_.push_back(more);
  }
  PacedStop listing(stop, 256);
  for (const std::uint32_t v : vertices) {
    listing.check();
    list_vertex(scene, places, v, rows);
  }
  finish(blocks, rows);
}

// The pairs around a vertex, of the rows marked.
void SharedVertices::list_vertex(const Scene& scene, const Places& places, std::uint32_t v,
                                 std::span<const std::uint8_t> rows) {
  std::array<std::uint32_t, kMostAround> of_vertex;
  const std::span<const std::uint32_t> faces = scene.vertex_faces()[v];
  const auto segments = lone_edges_of(scene, v);
  const auto of_face = [&](std::uint32_t f) { return places.faces.of(NewFace{f}); };
  const auto of_segment = [&](EdgeId e) { return places.segments.of(e); };
  if (faces.size() + segments.size() > kMostAround) {
    crowded_.resize(others_.size() / kRow);
    for (const std::uint32_t f : faces) crowded_[of_face(f) / kBlockSize] = 1;
    for (const EdgeId e : segments) crowded_[of_segment(e) / kBlockSize] = 1;
    return;
  }
  std::ranges::transform(faces, of_vertex.begin(), of_face);
  std::ranges::transform(segments, of_vertex.begin() + static_cast<std::ptrdiff_t>(faces.size()), of_segment);
  list_around(std::span(of_vertex).first(faces.size() + segments.size()), rows);
}

// Adds to the rows marked the pairs that do not exist.
void SharedVertices::finish(std::span<const std::span<const Primitive>> blocks,
                            std::span<const std::uint8_t> rows) {
  const auto none = [&](std::size_t a, std::size_t b) {
    return no_pairs(static_cast<std::uint32_t>(blocks[a].size()),
                    static_cast<std::uint32_t>(blocks[b].size()), a == b);
  };
  for (std::size_t row = 0; row < blocks.size(); ++row) {
    if (!is_marked(rows, row)) continue;
    for (std::size_t place = kRow * row; place < kRow * (row + 1) && others_[place] != kNone; ++place)
      pairs_[place] |= none(row, others_[place]);
  }
  if (!more_.empty()) has_more_.resize(blocks.size());
  for (More& more : more_) {
    if (is_marked(rows, more.owner)) more.pairs |= none(more.owner, more.other);
    has_more_[more.owner] = 1;
  }
  std::ranges::stable_sort(more_, {}, [](const More& more) { return std::pair(more.owner, more.other); });
}

// The items around a vertex: the pairs between two blocks are a product of their bits.
void SharedVertices::list_around(std::span<const std::uint32_t> places, std::span<const std::uint8_t> rows) {
  struct Items {
    std::uint32_t block;
    std::uint64_t bits;
  };
  std::array<Items, kMostAround> around;
  std::size_t count = 0;
  for (const std::uint32_t place : places) {
    std::size_t at = 0;
    while (at < count && around[at].block != place / kBlockSize) ++at;
    if (at == count) around[count++] = {place / kBlockSize, 0};
    around[at].bits |= std::uint64_t{1} << (place % kBlockSize);
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i; j < count; ++j) {
      const bool i_owns = around[i].block <= around[j].block;
      const Items& owner = around[i_owns ? i : j];
      const Items& other = around[i_owns ? j : i];
      if (is_marked(rows, owner.block)) add(owner.block, other.block, spread(owner.bits) * other.bits);
    }
  }
}

void SharedVertices::add(std::uint32_t owner, std::uint32_t other, std::uint64_t pairs) {
  const std::size_t row = std::size_t{kRow} * owner;
  for (std::size_t at = row; at < row + kRow; ++at) {
    if (others_[at] == kNone) others_[at] = other;
    if (others_[at] == other) {
      pairs_[at] |= pairs;
      return;
    }
  }
  more_.push_back({owner, other, pairs});
}

std::uint64_t SharedVertices::among_more(std::uint32_t owner, std::uint32_t other) const {
  const auto by = [](const More& more) { return std::pair(more.owner, more.other); };
  const auto wanted = std::pair(owner, other);
  std::uint64_t pairs = 0;
  // One entry for each vertex that they share.
  for (auto at = std::ranges::lower_bound(more_, wanted, {}, by); at != more_.end() && by(*at) == wanted;
       ++at)
    pairs |= at->pairs;
  return pairs;
}

void list_changed_rows(const SharedVertices& before, const SharedVertices& now,
                       std::span<std::uint8_t> blocks) {
  for (std::uint32_t b = 0; b < blocks.size(); ++b) blocks[b] |= now.has_same_row(BlockId{b}, before) ? 0 : 1;
}

namespace {

std::vector<std::span<const Primitive>> blocks_of(const TreeShape& shape, std::span<const Primitive> order) {
  std::vector<std::span<const Primitive>> blocks;
  blocks.reserve(shape.block_count());
  for (BlockId b{0}; b < shape.end_block(); ++b)
    blocks.push_back(order.subspan(shape.begin_of_block(b), shape.size_of_block(b)));
  return blocks;
}

}  // namespace

std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order, StopSignal stop) {
  if (shape.leaf_size() == 1 || order.empty()) return nullptr;
  return std::make_shared<const SharedVertices>(scene, blocks_of(shape, order), stop);
}

std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order,
                                                      const SharedVertices& before,
                                                      std::span<const std::uint8_t> changed,
                                                      StopSignal stop) {
  if (!before.can_be_followed()) return shared_vertices(scene, shape, order, stop);
  return std::make_shared<const SharedVertices>(scene, blocks_of(shape, order), before, changed, stop);
}

}  // namespace warmfront
