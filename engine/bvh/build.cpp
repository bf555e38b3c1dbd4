// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "engine/bvh/bvh.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

std::uint32_t shares(std::uint32_t count, std::uint32_t most) {
  return count / most + (count % most != 0);
}

}  // namespace

TreeShape::TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size)
    : primitives_(primitive_count),
      leaf_size_(leaf_size),
      blocks_(std::max(1U, shares(primitive_count, std::min(leaf_size, kBlockSize)))),
      leaves_(shares(blocks_, std::max(1U, leaf_size / kBlockSize))),
      largest_block_(shares(primitive_count, blocks_)),
      depth_(std::bit_width(leaves_ - 1)) {}

Face primitive_vertices(const Scene& scene, Primitive primitive) {
  if ((primitive & kPoint) == 0) return scene.faces()[primitive];
  const std::uint32_t v = primitive & ~kPoint;
  return {v, v, v};
}

namespace {

using Centroid = std::array<double, 3>;

// The centroid of each primitive, by its index in the list to be ordered, and of its body. Bodies are
// numbered from the first one present.
struct Places {
  std::vector<Centroid> own;
  std::vector<Centroid> of_body;    // by body
  std::vector<std::uint32_t> body;  // by place
};

struct Splitter {
  const TreeShape& shape;
  const Places& places;
  std::span<std::uint32_t> order;
  StopSignal stop;

  void split(NodeId node) const {
    if (shape.is_leaf(node)) return split_blocks(shape.first_block(node), shape.end_block(node));
    const NodeId first = TreeShape::left(node);
    split_at(shape.begin(node), shape.end(first), shape.end(node));
    in_parallel(
        shape.end(node) - shape.begin(node), [&] { split(first); }, [&] { split(first + 1); });
  }

  void split_blocks(std::uint32_t first, std::uint32_t last) const {
    if (last - first < 2) return;
    const std::uint32_t middle = first + (last - first + 1) / 2;
    split_at(shape.begin_of_block(first), shape.begin_of_block(middle), shape.begin_of_block(last));
    split_blocks(first, middle);
    split_blocks(middle, last);
  }

  template <class Left, class Right>
  static void in_parallel(std::uint32_t size, Left&& left, Right&& right) {
    constexpr std::uint32_t kSerialBelow = 2048;
    if (size < kSerialBelow) {
      left();
      right();
    } else {
      tbb::parallel_invoke(left, right);
    }
  }

  void split_at(std::uint32_t first, std::uint32_t half, std::uint32_t last) const {
    const auto begin = order.begin() + first;
    const auto middle = order.begin() + half;
    const auto end = order.begin() + last;
    const std::span<const std::uint32_t> range{begin, end};
    PacedStop paced(stop);
    const bool one_body =
        std::ranges::all_of(range, [&](std::uint32_t p) { return places.body[p] == places.body[range[0]]; });
    if (last - first >= PacedStop::kEvery) stop.check();
    if (one_body) {
      const int axis = widest_axis(range, paced, [this](std::uint32_t p) { return places.own[p]; });
      std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
        paced.check();
        return before(a, b, axis);
      });
    } else {
      const int axis =
          widest_axis(range, paced, [this](std::uint32_t p) { return places.of_body[places.body[p]]; });
      std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
        paced.check();
        return body_before(a, b, axis);
      });
    }
  }

  // Ties are broken by numbers, so that each half is the same set on any thread.
  bool before(std::uint32_t a, std::uint32_t b, int axis) const {
    const double x = places.own[a][axis];
    const double y = places.own[b][axis];
    return x != y ? x < y : a < b;
  }

  bool body_before(std::uint32_t a, std::uint32_t b, int axis) const {
    const std::uint32_t body_a = places.body[a];
    const std::uint32_t body_b = places.body[b];
    if (body_a == body_b) return before(a, b, axis);
    const double x = places.of_body[body_a][axis];
    const double y = places.of_body[body_b][axis];
    return x != y ? x < y : body_a < body_b;
  }

  template <class PlaceOf>
  static int widest_axis(std::span<const std::uint32_t> primitives, PacedStop& paced, PlaceOf&& place_of) {
    Centroid lo = place_of(primitives[0]);
    Centroid hi = lo;
    for (const std::uint32_t p : primitives) {
      paced.check();
      const Centroid place = place_of(p);
      for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min(lo[axis], place[axis]);
        hi[axis] = std::max(hi[axis], place[axis]);
      }
    }
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (hi[axis] - lo[axis] > hi[widest] - lo[widest]) widest = axis;
    }
    return widest;
  }
};

Places find_places(const Scene& scene, const Motion& motion, std::span<const Primitive> primitives,
                   StopSignal stop) {
  Places places{std::vector<Centroid>(primitives.size()), {}, std::vector<std::uint32_t>(primitives.size())};
  const LocalTransform& frame = motion.frame();
  for_each_index(0, primitives.size(), stop, [&](std::size_t p) {
    const Face vertices = primitive_vertices(scene, primitives[p]);
    places.body[p] = scene.body_of_vertex()[vertices[0]];
    for (int axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (const std::uint32_t v : vertices) {
        // Outside the frame's range all centroids are equal; a NaN sum would break the order.
        sum += std::clamp(frame.to_local(motion.vertices()[v].t1[axis]), -1e290, 1e290);
      }
      places.own[p][axis] = sum / 3;
    }
  });
  const auto [least, most] = std::ranges::minmax(places.body);
  for (std::uint32_t& body : places.body) body -= least;
  places.of_body.resize(std::size_t{most} - least + 1);
  std::vector<double> counts(places.of_body.size(), 0);
  PacedStop paced(stop);
  for (std::size_t p = 0; p < primitives.size(); ++p) {
    paced.check();
    Centroid& sum = places.of_body[places.body[p]];
    for (int axis = 0; axis < 3; ++axis) sum[axis] += places.own[p][axis];
    counts[places.body[p]] += 1;
  }
  for (std::size_t b = 0; b < counts.size(); ++b) {
    for (double& x : places.of_body[b]) x /= std::max(1.0, counts[b]);
  }
  return places;
}

}  // namespace

std::vector<Primitive> build_order(const Scene& scene, const Motion& motion, const TreeShape& shape,
                                   std::span<const Primitive> primitives, StopSignal stop) {
  if (primitives.empty()) return {};
  std::vector<std::uint32_t> order(primitives.size());
  std::iota(order.begin(), order.end(), 0U);
  const Places places = find_places(scene, motion, primitives, stop);
  Splitter{shape, places, order, stop}.split(0);
  for (std::uint32_t& p : order) p = primitives[p];
  return order;
}

template <class Bounds>
void Bvh<Bounds>::list_block_vertices(const Scene& scene, StopSignal stop) {
  block_vertices = {};
  if (travel.empty() || blocks.empty()) return;
  std::uint32_t first = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t last = 0;
  PacedStop paced(stop);
  for (const Primitive p : order) {
    paced.check();
    for (const std::uint32_t v : primitive_vertices(scene, p)) {
      first = std::min(first, v);
      last = std::max(last, v);
    }
  }
  std::vector<std::uint32_t> seen_in(last - first + 1, shape.block_count());
  block_vertices.begin.reserve(shape.block_count() + 1);
  block_vertices.items.reserve(order.size() + order.size() / 2);
  PacedStop paced_blocks(stop, 256);
  for (std::uint32_t block = 0; block < shape.block_count(); ++block) {
    paced_blocks.check();
    block_vertices.begin.push_back(static_cast<std::uint32_t>(block_vertices.items.size()));
    for (std::uint32_t i = shape.begin_of_block(block); i < shape.begin_of_block(block + 1); ++i) {
      for (const std::uint32_t v : primitive_vertices(scene, order[i])) {
        if (std::exchange(seen_in[v - first], block) != block) block_vertices.items.push_back(v);
      }
    }
  }
  block_vertices.begin.push_back(static_cast<std::uint32_t>(block_vertices.items.size()));
  block_vertices.items.shrink_to_fit();
}

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

}  // namespace

template <class Bounds>
void Bvh<Bounds>::arrange(const Scene& scene, const TreeShape& new_shape, std::vector<Primitive> new_order,
                          std::shared_ptr<const SharedVertices> new_shared, bool keep_travel,
                          StopSignal stop) {
  shape = new_shape;
  order = std::move(new_order);
  shared = std::move(new_shared);
  built_looseness = 0;
  make_room(nodes, order.empty() ? 0 : shape.node_count(), stop);
  begin_anew(states, nodes.size(), stop);
  const std::size_t faces = order.size() - static_cast<std::size_t>(std::ranges::count_if(
                                               order, [](Primitive p) { return (p & kPoint) != 0; }));
  make_room(leaf_of_face, faces, stop);
  first_face = 0;
  if (faces > 0)  // points have greater numbers than faces
    first_face = *std::ranges::min_element(order);
  begin_anew(travel, keep_travel ? nodes.size() : 0, stop);
  begin_anew(block_travel, keep_travel && shape.has_wide_leaves() ? shape.block_count() : 0, stop);
  make_room(blocks, shape.leaf_size() == 1 || order.empty() ? 0 : shape.block_count(), stop);
  make_room(corners, blocks.size(), stop);
  make_room(wide, shape.has_wide_leaves() && !order.empty() ? shape.leaf_count() : 0, stop);
  begin_anew(grids, blocks.empty() ? 0 : shape.leaf_count(), stop);
  stop.check();
  PacedStop paced(stop, 64);
  if (!order.empty()) {
    for (NodeId node = shape.first_leaf(); node < shape.node_count(); ++node) {
      paced.check();
      for (std::uint32_t i = shape.begin(node); i < shape.end(node); ++i) {
        if ((order[i] & kPoint) == 0) leaf_of_face[order[i] - first_face] = node;
      }
    }
  }
  list_block_vertices(scene, stop);
  blocks_of.clear();
  if (blocks.empty()) return;
  blocks_of.reserve(shape.leaf_count());
  for (NodeId leaf = shape.first_leaf(); leaf < shape.node_count(); ++leaf)
    blocks_of.push_back({shape.first_block(leaf), shape.end_block(leaf)});
  for_each_index(
      0, shape.block_count(), stop,
      [&](std::size_t b) {
        const auto block = static_cast<std::uint32_t>(b);
        const std::uint32_t begin = shape.begin_of_block(block);
        const std::uint32_t size = shape.size_of_block(block);
        for (std::uint32_t i = 0; i < EightBounds<Bounds>::kSlots; ++i) {
          const Face vertices = primitive_vertices(scene, order[begin + (i < size ? i : 0)]);
          for (int corner = 0; corner < 3; ++corner) corners[block].vertex[corner][i] = vertices[corner];
        }
      },
      512);
}

std::shared_ptr<const SharedVertices> shared_vertices(const Scene& scene, const TreeShape& shape,
                                                      std::span<const Primitive> order, StopSignal stop) {
  if (shape.leaf_size() == 1 || order.empty()) return nullptr;
  std::vector<std::span<const Primitive>> blocks;
  blocks.reserve(shape.block_count());
  for (std::uint32_t b = 0; b < shape.block_count(); ++b)
    blocks.push_back(order.subspan(shape.begin_of_block(b), shape.size_of_block(b)));
  return std::make_shared<const SharedVertices>(scene, blocks, stop);
}

template void Bvh<Aabb>::arrange(const Scene&, const TreeShape&, std::vector<Primitive>,
                                 std::shared_ptr<const SharedVertices>, bool, StopSignal);
template void Bvh<KDop18>::arrange(const Scene&, const TreeShape&, std::vector<Primitive>,
                                   std::shared_ptr<const SharedVertices>, bool, StopSignal);

}  // namespace warmfront
