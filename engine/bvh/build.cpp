// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "engine/bvh/bvh.h"

namespace warmfront {

TreeShape::TreeShape(std::uint32_t primitive_count, std::uint32_t leaf_size) : primitives_(primitive_count) {
  while ((std::uint64_t{leaf_size} << depth_) < primitive_count) ++depth_;
}

Face primitive_vertices(const Scene& scene, std::uint32_t primitive) {
  if (primitive < scene.face_count()) return scene.faces()[primitive];
  const std::uint32_t v = scene.isolated_vertices()[primitive - scene.face_count()];
  return {v, v, v};
}

namespace {

using Centroid = std::array<double, 3>;

struct Splitter {
  const TreeShape& shape;
  std::span<const Centroid> centroids;
  std::span<std::uint32_t> order;

  void split(int level, std::uint32_t index) const {
    if (level + 1 == shape.levels()) return;
    const auto begin = order.begin() + shape.begin(level, index);
    const auto middle = order.begin() + shape.begin(level + 1, 2 * index + 1);
    const auto end = order.begin() + shape.begin(level, index + 1);
    const int axis = widest_axis({begin, end});
    // Ties are broken by the primitive's number, so that each half is one set, whoever computes it.
    std::nth_element(begin, middle, end, [this, axis](std::uint32_t a, std::uint32_t b) {
      return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
    });
    const auto left = [&] { split(level + 1, 2 * index); };
    const auto right = [&] { split(level + 1, 2 * index + 1); };
    constexpr std::ptrdiff_t kSerialBelow = 2048;
    if (end - begin < kSerialBelow) {
      left();
      right();
    } else {
      tbb::parallel_invoke(left, right);
    }
  }

  int widest_axis(std::span<const std::uint32_t> primitives) const {
    Centroid lo = centroids[primitives[0]];
    Centroid hi = lo;
    for (const std::uint32_t p : primitives) {
      for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min(lo[axis], centroids[p][axis]);
        hi[axis] = std::max(hi[axis], centroids[p][axis]);
      }
    }
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (hi[axis] - lo[axis] > hi[widest] - lo[widest]) widest = axis;
    }
    return widest;
  }
};

}  // namespace

std::vector<std::uint32_t> build_order(const Scene& scene, const Motion& motion, const TreeShape& shape) {
  std::vector<std::uint32_t> order(shape.primitive_count());
  std::iota(order.begin(), order.end(), 0U);
  std::vector<Centroid> centroids(order.size());
  const LocalFrame& frame = motion.frame();
  tbb::parallel_for(std::size_t{0}, centroids.size(), [&](std::size_t p) {
    const Face vertices = primitive_vertices(scene, static_cast<std::uint32_t>(p));
    for (int axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (const std::uint32_t v : vertices) sum += frame.to_local(motion.vertices()[v].t1[axis]);
      centroids[p][axis] = sum;
    }
  });
  if (!order.empty()) Splitter{shape, centroids, order}.split(0, 0);
  return order;
}

}  // namespace warmfront
