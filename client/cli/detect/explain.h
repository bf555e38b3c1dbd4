// SPDX-License-Identifier: Apache-2.0
// Savings of a scene's model, compared with the same motion and everything deformable: stepped in this
// process, which also compares the contacts, or as reported by a daemon. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "client/cli/detect/stepper.h"
#include "engine/contact_hash.h"
#include "engine/scene/collision_model.h"

namespace warmfront::client {

class Explanation {
 public:
  /// `scene` with its model; `positions` in the same precision as for the model's stepper. Fails as
  /// make_local_stepper() does.
  static Result<Explanation> start(const SceneDescription& scene, std::span<const double> positions,
                                   const ColliderOptions& options, int threads);

  /// From a daemon's answers with options.explain.
  static Explanation of_answers() { return Explanation(Scene{}, nullptr); }

  /// Steps the all-deformable scene to `positions`, and records the cost of the model's step. Fails with
  /// kInternal when the model's contacts are not the all-deformable ones without the excluded pairs, or when
  /// an answer lacks the comparison.
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
  std::unique_ptr<Stepper> all_;  // null: reported by a daemon
  Sums modelled_;
  Sums deformable_;
  std::uint64_t steps_ = 0;
};

}  // namespace warmfront::client
