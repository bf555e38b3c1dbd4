// SPDX-License-Identifier: Apache-2.0
// What a pipeline keeps from step to step, writable, so that a test may damage it: of two grids, one in the
// other's way.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "engine/broad_phase/near_parts.h"
#include "engine/check/check_neighbours.h"
#include "engine/check/self_check.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

inline constexpr int kGridCells = 12;
inline constexpr std::uint32_t kGridVertices = (kGridCells + 1) * (kGridCells + 1);  // of each grid

/// Two grids, one in the other's way.
inline SceneDescription two_grids() {
  SceneDescription scene;
  scene.vertex_count = 2 * kGridVertices;
  scene.faces = grid(kGridCells);
  for (auto face : grid(kGridCells)) {
    for (auto& v : face) v += kGridVertices;
    scene.faces.push_back(face);
  }
  scene.bodies = {{"", 0, kGridVertices}, {"", kGridVertices, kGridVertices}};
  return scene;
}

inline std::vector<double> wavy_grids(double at) {
  std::vector<double> positions;
  for (int grid = 0; grid < 2; ++grid) {
    for (int i = 0; i <= kGridCells; ++i) {
      for (int j = 0; j <= kGridCells; ++j) {
        positions.push_back(i + 0.3 * grid);
        positions.push_back(j + 0.2 * grid);
        positions.push_back(at * grid + std::sin(0.9 * i + 0.5 * j + grid));
      }
    }
  }
  return positions;
}

inline SceneDescription filtered_grids() {
  SceneDescription scene = two_grids();
  scene.filters = {.within_edges = 1,
                   .near_at_rest = 1e-9,
                   .rest_positions = wavy_grids(0.5),
                   .excluded_vertex_pairs = {{0, kGridVertices}},
                   .patches = std::vector<std::uint32_t>(scene.vertex_count, 0)};
  return scene;
}

/// A pipeline's cached data, writable.
template <class Bounds>
struct KeptPipeline {
  /// Leaves of eight: a front of many pairs over a small scene.
  explicit KeptPipeline(std::uint32_t leaf_size = 8)
      : core(scene, *scene, std::span<const double>(start), {.leaf_size = leaf_size},
             std::make_shared<Workers>(2)) {
    core.workers->run([&] {
      for (const double at : {0.3, 0.2}) step(at);
    });
  }

  void step(double at) {
    const std::vector<double> positions = wavy_grids(at);
    Frame frame{std::span<const double>(positions)};
    ASSERT_TRUE(core.motion.check(*core.scene, frame).ok());
    SceneMotion::Step step(core.motion);
    step.begin(frame);
    step.commit();
    const auto& parts = core.topology->parts;
    const Motion& motion = core.motion.vertices();
    for (std::size_t v = 0; v < core.vertex_bounds.size(); ++v)
      core.vertex_bounds[v] = point_bounds(motion.vertices()[v], motion.frame(), motion.magnitude());
    const bool first = trees.empty();
    trees.resize(parts.size());
    roots.resize(parts.size());
    refit_in.resize(parts.size());
    const std::vector<std::uint8_t> changed(parts.size(), 1);
    for (std::uint32_t p = 0; p < parts.size(); ++p) {
      if (first)
        trees[p].arrange(core.topology->scene, parts[p].shape, parts[p].order, parts[p].shared, true);
      refit<Bounds>({core.topology->scene, core.vertex_bounds, motion.states(), core.motion.range(PartId{p}),
                     motion.magnitude(), Known::kNothing},
                    trees[p]);
      roots[p] = trees[p].nodes[0];
    }
    std::uint64_t bv_tests = 0;
    const auto found = near_parts.find(core.model, roots, changed, true, bv_tests);
    near.assign(found.begin(), found.end());
    CountingSinks sinks;
    front.advance(trees, near, sinks, {.lazy = true});
  }

  Status check() {
    Status status;
    core.workers->run([&] {
      status = self_check<Bounds>({core,
                                   trees,
                                   roots,
                                   refit_in,
                                   0,
                                   near,
                                   {},
                                   apart,
                                   &front,
                                   core.motion.vertices().magnitude(),
                                   Width(),
                                   0});
    });
    return status;
  }
  /// The front's own memory.
  FrontSegment& segment(std::size_t s) { return const_cast<FrontSegment&>(front.segments()[s]); }
  NeighbourChunk& neighbours(std::size_t c) {
    return const_cast<Neighbours&>(front.neighbours()).of(PartId{0})[c];
  }
  FrontPair& first_disjoint() {
    for (const FrontSegment& its : front.segments()) {
      const bool self = its.parts.a == its.parts.b;
      const Bvtt bvtt(trees[number_of(its.parts.a)].shape, trees[number_of(its.parts.b)].shape, self);
      for (const FrontChunk& chunk : its.chunks)
        for (const FrontPair& pair : chunk.pairs)
          if (!bvtt.is_leaf(pair.nodes)) return const_cast<FrontPair&>(pair);
    }
    throw std::logic_error("no pair is disjoint");
  }

  const std::vector<double> start = wavy_grids(0.5);
  const std::shared_ptr<const Scene> scene =
      std::make_shared<const Scene>(Scene::create(filtered_grids()).value());
  Core core;
  std::vector<Bvh<Bounds>> trees;
  std::vector<Bounds> roots;
  NearParts<Bounds> near_parts;
  std::vector<std::int64_t> refit_in;
  std::vector<NearPair> near;
  std::vector<ApartPair> apart;
  Front<Bounds> front;
};

}  // namespace warmfront::testing
