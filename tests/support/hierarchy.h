// SPDX-License-Identifier: Apache-2.0
// Scene, motion and hierarchy put together for tests that look between the pipeline's stages.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bvh/bvh.h"
#include "engine/front/leaf_pairs.h"

namespace warmfront::testing {

/// A sink that counts.
class CountingSinks final : public LeafPairSinks, public LeafPairSink {
 public:
  LeafPairSink& local() override { return *this; }
  float leaf_pair(NodeId, NodeId) override {
    ++count;
    return -1;
  }
  std::atomic<std::uint64_t> count{0};
};

template <class Bounds>
class Hierarchy {
 public:
  Hierarchy(std::shared_ptr<const Scene> scene, std::span<const double> positions, std::uint32_t leaf_size)
      : scene_(std::move(scene)),
        last_(positions.begin(), positions.end()),
        motion_(positions),
        bounds_(scene_->vertex_count()) {
    const auto primitives =
        static_cast<std::uint32_t>(scene_->face_count() + scene_->isolated_vertices().size());
    const TreeShape shape(primitives, leaf_size);
    bvh.arrange(*scene_, shape, build_order(*scene_, motion_, shape), true);
    refresh();
  }

  void step(std::span<const double> positions) {
    motion_.set(last_, positions);
    last_.assign(positions.begin(), positions.end());
    refresh();
  }

  std::span<const KDop18> vertex_bounds() const { return bounds_; }

  Bvh<Bounds> bvh;

 private:
  void refresh() {
    const double magnitude = motion_magnitude(motion_.vertices(), motion_.frame(), 0);
    for (std::size_t v = 0; v < bounds_.size(); ++v) {
      bounds_[v] = moving_bounds(motion_.vertices()[v], motion_.frame(), 0, magnitude);
    }
    refit(*scene_, bounds_, magnitude, bvh);
  }

  std::shared_ptr<const Scene> scene_;
  std::vector<double> last_;
  Motion motion_;
  std::vector<KDop18> bounds_;
};

}  // namespace warmfront::testing
