// SPDX-License-Identifier: Apache-2.0
// Scene, motion and hierarchy for tests of single pipeline stages.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/build.h"
#include "engine/bvh/bvh.h"
#include "engine/bvh/refit.h"
#include "engine/front/front.h"

namespace warmfront::testing {

/// A sink that counts.
class CountingSinks final : public LeafPairSinks, public LeafPairSink {
 public:
  LeafPairSink& local() override { return *this; }
  StageClock& clock() override { return clocks_.local(); }
  LeafGap leaf_pair(const PartPair&, const NodePair&, const LeafBlocks&) override {
    ++count;
    return {-1, false};
  }
  LeafGap leaf_pair_at_rest(const PartPair&, const NodePair&, const LeafBlocks&,
                            RestAnswer& answer) override {
    ++count;
    answer.triangle_pairs = 1;
    return {-1, false};
  }
  void neighbours(PartId, NeighbourChunk& chunk) override {
    ++neighbour_chunks;
    chunk.may_have_contacts = false;
  }
  void neighbours_at_rest(PartId part, NeighbourChunk& chunk) override { neighbours(part, chunk); }
  void keep(std::uint64_t triangle_pairs, const ContactTally&, std::span<const Contact>) override {
    count += triangle_pairs;
  }
  std::uint64_t triangle_pairs() const override { return count; }
  std::atomic<std::uint64_t> count{0};
  std::atomic<std::uint64_t> neighbour_chunks{0};

 private:
  tbb::enumerable_thread_specific<StageClock> clocks_;
};

/// Refits a whole hierarchy; `then`, if any, is called with each subtree that changed, by the task that refit
/// it. Returns how many nodes changed.
template <class Bounds>
std::size_t refit(const RefitInput& input, Bvh<Bounds>& bvh,
                  const std::function<void(std::uint32_t subtree)>& then = {}) {
  const Refit<Bounds> refit(input, bvh);
  for_subtrees(refit.subtree_count(), [&](std::uint32_t subtree) {
    if (refit.refit_subtree(subtree) && then) then(subtree);
  });
  return refit.finish();
}

/// Faces, lone edges and isolated vertices.
inline std::vector<Primitive> all_primitives(const Scene& scene) {
  std::vector<Primitive> all;
  for (std::uint32_t f = 0; f < scene.face_count(); ++f) all.push_back(primitive_of_face(f));
  for (const EdgeId e : lone_edges(scene)) all.push_back(primitive_of_edge(e));
  for (const std::uint32_t v : scene.isolated_vertices()) all.push_back(primitive_of_vertex(v));
  return all;
}

/// A whole scene as one part.
template <class Bounds>
class Hierarchy {
 public:
  Hierarchy(std::shared_ptr<const Scene> scene, std::span<const double> positions, std::uint32_t leaf_size)
      : scene_(std::move(scene)), motion_(positions), bounds_(scene_->vertex_count()) {
    for (std::uint32_t v = 0; v < scene_->vertex_count(); ++v) order_.push_back(GivenVertex{v});
    const std::vector<Primitive> primitives = all_primitives(*scene_);
    const TreeShape shape(static_cast<std::uint32_t>(primitives.size()), leaf_size);
    const std::vector<Primitive> order = build_order(*scene_, motion_, shape, primitives);
    bvh.arrange(*scene_, shape, order, shared_vertices(*scene_, shape, order), true);
    motion_.measure(0, scene_->vertex_count(), range_);
    motion_.follow(range_.reach);
    refresh(Known::kNothing);
  }

  void step(std::span<const double> positions) {
    const double before = range_.reach;
    motion_.move_all(0, scene_->vertex_count(), From::kEnd, positions, order_, 0, range_);
    motion_.follow(std::max(before, range_.reach));
    refresh(motion_.magnitude() != magnitude_ ? Known::kNothing : Known::kLastStep);
  }

  /// The hierarchy with all its bounds recomputed from this step's motion only.
  Bvh<Bounds> anew() const {
    Bvh<Bounds> tree = bvh;
    std::vector<PointBounds> bounds(bounds_.size());
    refit_with(Known::kNothing, bounds, tree);
    return tree;
  }

  std::span<const PointBounds> vertex_bounds() const { return bounds_; }
  const Motion& motion() const { return motion_; }

  Bvh<Bounds> bvh;
  std::function<void(std::uint32_t subtree)> then;  ///< called with each subtree that step() refits

 private:
  void refresh(Known known) {
    magnitude_ = motion_.magnitude();
    refit_with(known, bounds_, bvh);
  }

  void refit_with(Known known, std::vector<PointBounds>& bounds, Bvh<Bounds>& tree) const {
    point_bounds(motion_.vertices(), motion_.states(), motion_.frame(), magnitude_, known, bounds.data());
    refit<Bounds>({*scene_, bounds, motion_.states(), range_, magnitude_, known}, tree,
                  &tree == &bvh ? then : nullptr);
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<GivenVertex> order_;
  Motion motion_;
  RangeMotion range_;
  double magnitude_ = 0;
  std::vector<PointBounds> bounds_;
};

/// Updates a front of one part to this step.
template <class Bounds>
void advance(Front<Bounds>& front, const Hierarchy<Bounds>& hierarchy, LeafPairSinks& sinks,
             const FrontUpdate& how = {}) {
  const NearPair self{{PartId{0}, PartId{0}}, false};
  front.advance({&hierarchy.bvh, 1}, {&self, 1}, sinks, how);
}

/// Builds this step's front from scratch.
template <class Bounds>
void build(Front<Bounds>& front, const Hierarchy<Bounds>& hierarchy, LeafPairSinks& sinks,
           const FrontUpdate& how = {}) {
  front.clear();
  advance(front, hierarchy, sinks, how);
}

}  // namespace warmfront::testing
