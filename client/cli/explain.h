// SPDX-License-Identifier: Apache-2.0
// What a scene's model saves, against the same motion with everything deformable: stepped here, where the
// contacts are compared too, or as a daemon tells it. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "client/cli/stepper.h"
#include "engine/contact_hash.h"
#include "engine/scene/collision_model.h"

namespace warmfront::client {

class Explanation {
 public:
  /// `scene` with its model; `positions` as the model's stepper has them. Fails as make_local_stepper() does.
  static Result<Explanation> start(const SceneDescription& scene, std::span<const double> positions,
                                   const ColliderOptions& options, int threads);

  /// Of a daemon's answers with options.explain.
  static Explanation of_answers() { return Explanation(Scene{}, nullptr); }

  /// Steps the all-deformable scene to `positions`, and takes down what the model's step to there cost. Fails
  /// with kInternal when the model's contacts are not the all-deformable ones less the pairs that it
  /// excludes, or when an answer does not tell.
  Status step(std::span<const double> positions, const StepAnswer& modelled, std::uint64_t frame_bytes,
              std::uint64_t all_bytes);

  /// A table for people.
  void print() const;

 private:
  struct Sums {
    double ms = 0;
    StepCounts counts;
    std::uint64_t contacts = 0;
    std::uint64_t bytes = 0;
  };

  Status compare(const StepAnswer& modelled, const StepAnswer& all) const;

  Explanation(Scene scene, std::unique_ptr<Stepper> all)
      : scene_(std::move(scene)), model_(scene_), all_(std::move(all)) {}

  Scene scene_;
  CollisionModel model_;
  std::unique_ptr<Stepper> all_;  // null: the answers tell
  Sums modelled_;
  Sums deformable_;
  std::uint64_t steps_ = 0;
};

}  // namespace warmfront::client
