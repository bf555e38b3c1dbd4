// SPDX-License-Identifier: Apache-2.0
// What a collider's callers may rely on, kept the simplest way: the operations that were accepted, and
// nothing of those that were refused, cancelled or met a fault. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/support/draws.h"
#include "tests/support/operations.h"

namespace warmfront::testing {

struct AcceptedState {
  AcceptedState() = default;
  /// At rest at `positions`; rigid bodies are their own reference shapes.
  AcceptedState(SceneDescription scene, std::vector<double> positions);

  SceneDescription scene;         ///< with the bodies as they are by now
  std::vector<double> positions;  ///< where everything is, (n, 3)
  std::vector<double> reference;  ///< (n, 3), of the rigid bodies: what a pose is of
  /// By body: of a rigid one that was last put somewhere by a pose, that pose; its positions are known by
  /// reference and pose then. None of one whose positions were given.
  std::vector<std::optional<Pose>> pose;
  bool stepped = false;
  std::optional<StepOperation> trial;  ///< that may be committed
  double unit = 1;                     ///< what is drawn for it is of this size, ...
  double offset = 0;                   ///< ... and near here, on each axis

  bool fixed(std::size_t body) const;

  /// Takes an operation that is valid.
  void accept(const Operation& operation);

  /// A collider that never saw another state: made of the reference shapes, and placed.
  Collider fresh(const ColliderOptions& options, const std::shared_ptr<Workers>& workers) const;

  /// What of this a collider shows otherwise, in a few words; empty when nothing.
  std::string difference(const Collider& collider) const;

  /// The answer to a valid step by testing every pair of features that the scene lets meet, one by one; tiers
  /// certified and exact.
  Outcome brute_force(const StepOperation& step, const ColliderOptions& options) const;
};

/// A scene of a few small bodies of all kinds, near each other, of a size near 1; without declared bodies now
/// and then.
AcceptedState draw_state(Draws& draws);
/// The state before its first step at another size and place: `unit` times as large, then moved by `offset`
/// units along each axis.
AcceptedState scaled(AcceptedState state, double unit, double offset);
/// A valid frame: everything, or some bodies by positions, some by poses, some by single vertices; one that
/// moves nothing now and then.
StepOperation draw_step(Draws& draws, const AcceptedState& state);
/// Options of one question; some contradict those of a session in the exact tier.
QuestionOptions draw_question(Draws& draws, const AcceptedState& state);
/// A body to be added, and one described otherwise; of a scene that declares bodies.
AddOperation draw_addition(Draws& draws, const AcceptedState& state);
ChangeOperation draw_change(Draws& draws, const AcceptedState& state);
/// Poses for some of the rigid bodies.
PlaceOperation draw_place(Draws& draws, const AcceptedState& state);
/// The step with one thing wrong, by which it must be refused as invalid.
StepOperation spoiled(Draws& draws, const AcceptedState& state, StepOperation step);

}  // namespace warmfront::testing
