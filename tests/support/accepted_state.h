// SPDX-License-Identifier: Apache-2.0
// The simplest model of a collider's state: the effect of all accepted operations, and of none that was
// refused, cancelled or met a fault. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/support/draws.h"
#include "tests/support/operations.h"

namespace warmfront::testing {

struct AcceptedState {
  AcceptedState() = default;
  /// Stationary at `positions`, which are also the reference shapes of rigid bodies.
  AcceptedState(SceneDescription scene, std::vector<double> positions);

  SceneDescription scene;         ///< with the current bodies
  std::vector<double> positions;  ///< all current positions, (n, 3)
  std::vector<double> reference;  ///< (n, 3), of the rigid bodies: the shapes that poses apply to
  /// By body: the last pose of a rigid body that was last moved by a pose; its positions are then given by
  /// reference and pose. None if its positions were given.
  std::vector<std::optional<Pose>> pose;
  bool stepped = false;
  Rounding rounding = Rounding::kFloat64;  ///< that max_step() leaves room for
  std::optional<StepOperation> trial;  ///< that may be committed
  /// Bodies that are drawn may move along screws: then no options of a session are of tier exact.
  bool may_turn = false;
  /// How it may go far, if at all: all is placed there, or moves, with questions on the way. These are of
  /// tier exact: on motions of 1e5 scenes, what certified reports beside contacts depends on how pairs are
  /// found.
  enum class Travels : std::uint8_t { kNot, kPlaced, kMoving };
  Travels travels = Travels::kNot;
  double unit = 1;                     ///< what is drawn for it is of this size, ...
  double offset = 0;                   ///< ... and near here, on each axis

  bool fixed(std::size_t body) const;

  /// Applies a valid operation.
  void accept(const Operation& operation);

  /// A collider without history: created from the reference shapes, and placed.
  Collider fresh(const ColliderOptions& options, const std::shared_ptr<Workers>& workers) const;

  /// How a collider's state differs from this, in a few words; empty if it does not.
  std::string difference(const Collider& collider) const;
  /// The same of positions, those of removed bodies among them or not, and of the poses of rigid bodies.
  std::string difference(std::span<const double> shown, std::span<const BodyPose> poses,
                         bool of_removed) const;

  /// The answer to a valid step by testing every pair of features that the scene allows, one by one; tiers
  /// certified and exact.
  Outcome brute_force(const StepOperation& step, const ColliderOptions& options) const;
  /// The same for a question of proximity; at a trial's end there must be a trial.
  Outcome brute_force(const NearOperation& near, const ColliderOptions& options) const;
};

/// A scene of a few small near bodies of all kinds, of a size near 1; occasionally without declared bodies;
/// in half of all, bodies may move along screws.
AcceptedState draw_state(Draws& draws);
/// Layers of cloth, a crowd of small bodies, or a rolled sheet: hundreds to thousands of faces of edges
/// near 1.
AcceptedState draw_large_state(Draws& draws);
/// The state before its first step at another scale and position: `unit` times as large, then moved by
/// `offset` units along each axis.
AcceptedState scaled(AcceptedState state, double unit, double offset);
/// A valid frame: everything, or some bodies by positions, some by poses, some by single vertices;
/// occasionally empty.
StepOperation draw_step(Draws& draws, const AcceptedState& state);
/// A frame that takes all that may move to where it is `unit` large, near `offset` on each axis.
StepOperation draw_journey(Draws& draws, const AcceptedState& state, double unit, double offset);
/// A frame that moves what it moves by rounding errors, or by less.
StepOperation draw_noise(Draws& draws, const AcceptedState& state);
/// Options of one question; some contradict those of a session in the exact tier.
QuestionOptions draw_question(Draws& draws, const AcceptedState& state);
/// Of the base or, sometimes where there is one, of the last trial's end.
NearOperation draw_near(Draws& draws, const AcceptedState& state);
/// A body to be added, and one described otherwise; of a scene that declares bodies.
AddOperation draw_addition(Draws& draws, const AcceptedState& state);
ChangeOperation draw_change(Draws& draws, const AcceptedState& state);
/// Other filters, or none, as the only change.
ChangesOperation draw_filters(Draws& draws, const AcceptedState& state);
/// Other excluded pairs, or none.
ChangeExcludedPairs draw_excluded_pairs(Draws& draws, const AcceptedState& state);
/// Other options, which a session with these may have: tiers certified and exact.
ColliderOptions draw_other_options(Draws& draws, ColliderOptions options, double unit);
/// Poses for some of the rigid bodies.
PlaceOperation draw_place(Draws& draws, const AcceptedState& state);
/// The step with one error, for which it must be refused as invalid.
StepOperation spoiled(Draws& draws, const AcceptedState& state, StepOperation step);

}  // namespace warmfront::testing
