// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/build.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/primitives.h"

namespace warmfront {
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
        shape.end(node) - shape.begin(node), [&] { split(first); }, [&] { split(TreeShape::right(node)); });
  }

  void split_blocks(BlockId first, BlockId last) const {
    if (last - first < 2) return;
    const BlockId middle = first + (last - first + 1) / 2;
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
      fork_two(left, right);
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
  Splitter{shape, places, order, stop}.split(kRoot);
  std::vector<Primitive> ordered(order.size());
  std::ranges::transform(order, ordered.begin(), [&](std::uint32_t p) { return primitives[p]; });
  return ordered;
}

}  // namespace warmfront
