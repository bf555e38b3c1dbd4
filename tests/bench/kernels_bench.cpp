// SPDX-License-Identifier: Apache-2.0
// What the engine's kernels cost, each alone on one thread: bounds on neighbours in the hierarchy of a cloth
// that falls over a ball, elementary tests on random pairs as near as their own size. All seeded; "items" are
// pairs, of bounds_of_vertices vertices. Data fit the last-level cache: this is computation, not memory.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bounds/overlap.h"
#include "engine/bvh/eight_bounds.h"
#include "engine/elementary/certified.h"
#include "engine/elementary/elementary_test.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/narrow_phase/triangle_filter.h"
#include "tests/support/cloth_over_ball.h"
#include "tests/support/feature_case.h"
#include "tests/support/hierarchy.h"

namespace warmfront {
namespace {

using testing::FeatureCase;
using testing::Hierarchy;
using testing::Points;

constexpr int kSide = 40;
constexpr std::uint32_t kLeafSize = 8;
/// A node is tested against this many that follow it on its level.
constexpr std::size_t kNeighbours = 16;

/// A step of the cloth, with the hierarchy over it.
template <class Bounds>
class ClothStep {
 public:
  static ClothStep& get() {
    static ClothStep step;
    return step;
  }

  std::shared_ptr<const Scene> scene;
  Hierarchy<Bounds> hierarchy;

  std::span<const Bounds> leaf_nodes() const {
    return std::span(hierarchy.bvh.nodes).subspan(number_of(hierarchy.bvh.shape.first_leaf()));
  }

 private:
  ClothStep() : ClothStep(testing::cloth_over_ball(kSide, 8)) {}
  explicit ClothStep(const testing::ClothOverBall& cloth)
      : scene(std::make_shared<const Scene>(Scene::create(cloth.description).value())),
        hierarchy(scene, cloth.frames[6], kLeafSize) {
    hierarchy.step(cloth.frames[7]);
  }
};

/// Runs test(a, b) on every item and those that follow it; it gives a number.
template <class Items, class Test>
void run_on_neighbours(benchmark::State& state, const Items& items, Test&& test) {
  std::int64_t pairs = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i + kNeighbours < items.size(); ++i) {
      for (std::size_t j = i + 1; j <= i + kNeighbours; ++j)
        benchmark::DoNotOptimize(test(items[i], items[j]));
    }
    pairs += static_cast<std::int64_t>((items.size() - kNeighbours) * kNeighbours);
  }
  state.SetItemsProcessed(pairs);
}

template <class Bounds>
void node_overlap(benchmark::State& state) {
  run_on_neighbours(state, ClothStep<Bounds>::get().leaf_nodes(),
                    [](const Bounds& a, const Bounds& b) { return overlap(a, b); });
}
BENCHMARK(node_overlap<Aabb>);
BENCHMARK(node_overlap<KDop18>);

template <class Bounds>
void node_separation(benchmark::State& state) {
  run_on_neighbours(state, ClothStep<Bounds>::get().leaf_nodes(),
                    [](const Bounds& a, const Bounds& b) { return separation(a, b); });
}
BENCHMARK(node_separation<Aabb>);
BENCHMARK(node_separation<KDop18>);

/// Eight triangles against eight: an item is a pair of leaves.
template <class Bounds>
void leaf_against_leaf(benchmark::State& state) {
  const ClothStep<Bounds>& step = ClothStep<Bounds>::get();
  const auto& blocks = step.hierarchy.bvh.leaves.blocks;
  const auto& grids = step.hierarchy.bvh.leaves.grids;
  const auto leaf_of = [&](const BlockRange& block) {
    return static_cast<std::size_t>(&block - step.hierarchy.bvh.leaves.blocks_of.data());
  };
  run_on_neighbours(state, step.hierarchy.bvh.leaves.blocks_of,
                    [&](const BlockRange& a, const BlockRange& b) {
                      const LeafGrid<Bounds>& leaf_b = grids[leaf_of(b)];
                      const GridPair<Bounds> between = grid_pair(grids[leaf_of(a)], leaf_b);
                      const OneOfLeaf whole_b = OneOfLeaf::of(leaf_b);
                      Rebased<Bounds> over;
                      rebase(blocks[number_of(a.begin)], between, over);
                      return primitive_overlaps(over, blocks[number_of(b.begin)], between, &whole_b, 0, 1)
                          .to_test;
                    });
}
BENCHMARK(leaf_against_leaf<Aabb>);
BENCHMARK(leaf_against_leaf<KDop18>);

/// The fifteen feature pairs of two triangles: an item is a pair of triangles.
void features_of_triangles(benchmark::State& state) {
  const ClothStep<KDop18>& step = ClothStep<KDop18>::get();
  const auto bounds = step.hierarchy.vertex_bounds();
  std::vector<TriangleBounds> triangles;
  for (const Primitive p : step.hierarchy.bvh.order) {
    const Face face = primitive_vertices(*step.scene, p);
    triangles.push_back({{&bounds[face[0]], &bounds[face[1]], &bounds[face[2]]}});
  }
  constexpr std::uint32_t kAll = (1U << 15) - 1;
  run_on_neighbours(state, triangles, [](const TriangleBounds& f, const TriangleBounds& g) {
    return overlapping_features(f, g, kAll);
  });
}
BENCHMARK(features_of_triangles);

/// Planes between triangles: an item is eight pairs.
void planes_between_triangles(benchmark::State& state) {
  const ClothStep<KDop18>& step = ClothStep<KDop18>::get();
  const auto& corners = step.hierarchy.bvh.leaves.corners;
  const auto bounds = step.hierarchy.vertex_bounds();
  run_on_neighbours(state, corners, [&](const EightCorners& a, const EightCorners& b) {
    EightTrianglePairs pairs;
    std::ranges::copy(a.vertex, pairs.vertex.begin());
    std::ranges::copy(b.vertex, pairs.vertex.begin() + 3);
    return triangles_apart(pairs, bounds, certified_reach(1e-6));
  });
}
BENCHMARK(planes_between_triangles);

void bounds_of_vertices(benchmark::State& state) {
  const Motion& motion = ClothStep<KDop18>::get().hierarchy.motion();
  const auto vertices = motion.vertices();
  const std::vector<MotionState> states(vertices.size(), kChanged);
  std::vector<PointBounds> bounds(vertices.size());
  for (auto _ : state) {
    point_bounds(vertices, states, motion.frame(), motion.magnitude(), Known::kOlder, bounds.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * vertices.size()));
}
BENCHMARK(bounds_of_vertices);

/// Four vertices anywhere in the unit cube that move by up to half its side: a contact in one of some ten.
std::vector<FeatureCase> near_pairs(ContactKind kind, std::size_t count) {
  std::mt19937_64 random(2009);
  std::uniform_real_distribution<double> place(0, 1);
  std::uniform_real_distribution<double> move(-0.5, 0.5);
  std::vector<FeatureCase> cases;
  for (std::size_t i = 0; i < count; ++i) {
    Points t0{};
    Points t1{};
    for (std::size_t v = 0; v < t0.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        t0[v][axis] = place(random);
        t1[v][axis] = t0[v][axis] + move(random);
      }
    }
    cases.emplace_back(kind, t0, t1);
  }
  return cases;
}

void coplanarity(benchmark::State& state, ContactKind kind, double separation) {
  std::vector<VertexMotion> vertices;
  FeatureBlock block;
  for (const FeatureCase& feature : near_pairs(kind, FeatureBlock::kCapacity)) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), feature.vertices.begin(), feature.vertices.end());
    block.push({.vertices = {first, first + 1, first + 2, first + 3}, .a = 0, .b = 0, .kind = kind});
  }
  std::vector<std::uint16_t> survivors(block.size);
  const std::vector<double> separations(separation > 0 ? block.size : 0, separation);
  std::size_t left = 0;
  for (auto _ : state) {
    left = coplanarity_filter({block.pairs.data(), block.size}, vertices, separations, survivors.data());
    benchmark::DoNotOptimize(left);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * block.size));
  state.counters["left"] = static_cast<double>(left) / static_cast<double>(block.size);
}
BENCHMARK_CAPTURE(coplanarity, vf, ContactKind::kVertexFace, 0);
BENCHMARK_CAPTURE(coplanarity, ee, ContactKind::kEdgeEdge, 0);
BENCHMARK_CAPTURE(coplanarity, vf_separated, ContactKind::kVertexFace, 0.01);
BENCHMARK_CAPTURE(coplanarity, ee_separated, ContactKind::kEdgeEdge, 0.01);

void elementary(benchmark::State& state, Tier tier, ContactKind kind) {
  const std::vector<FeatureCase> cases = near_pairs(kind, 512);
  const ElementaryOptions options{.tier = tier};
  ElementaryCounts counts;
  std::size_t contacts = 0;
  for (auto _ : state) {
    contacts = 0;
    for (const FeatureCase& feature : cases)
      contacts += elementary_test(feature.features(), options, counts).contact ? 1 : 0;
    benchmark::DoNotOptimize(contacts);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * cases.size()));
  state.counters["contacts"] = static_cast<double>(contacts) / static_cast<double>(cases.size());
}
BENCHMARK_CAPTURE(elementary, fast_vf, Tier::kFast, ContactKind::kVertexFace);
BENCHMARK_CAPTURE(elementary, fast_ee, Tier::kFast, ContactKind::kEdgeEdge);
BENCHMARK_CAPTURE(elementary, certified_vf, Tier::kCertified, ContactKind::kVertexFace);
BENCHMARK_CAPTURE(elementary, certified_ee, Tier::kCertified, ContactKind::kEdgeEdge);
BENCHMARK_CAPTURE(elementary, exact_vf, Tier::kExact, ContactKind::kVertexFace);
BENCHMARK_CAPTURE(elementary, exact_ee, Tier::kExact, ContactKind::kEdgeEdge);

}  // namespace
}  // namespace warmfront
