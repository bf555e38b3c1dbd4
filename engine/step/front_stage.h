// SPDX-License-Identifier: Apache-2.0
// The stage that updates the front, or builds it, by the rules of its mode. Used by one thread at a time,
// inside Workers::run().
#pragma once

#include <cstdint>
#include <span>

#include "engine/front/front.h"
#include "engine/narrow_phase/narrow_phase.h"
#include "engine/options.h"
#include "engine/statistics.h"
#include "engine/stop.h"

namespace warmfront {

/// Is what was found of stationary leaf pairs not used again? For Report::kEarliest later contacts were left
/// out of it, for kAny all but one, and kVertexDistances keeps none.
inline bool retests(const ColliderOptions& options) {
  return options.report == Report::kEarliest || options.report == Report::kAny ||
         options.report == Report::kVertexDistances;
}

/// Of one question.
struct FrontInput {
  const ColliderOptions& options;
  GapAt gap_at;       ///< where budgets are granted
  PartWidths widths;  ///< as FrontUpdate says
  PartWidths fold_widths;
  bool wider;
  StopSignal stop;
};

template <class Bounds>
class FrontStage {
 public:
  /// Brings the front to this step: `near` must be the pairs of parts that are near each other, of which the
  /// hierarchies are refit and those neighbours tested that lie within their subtrees (RefitStage).
  /// `new_hierarchy`: a hierarchy was arranged anew in this step. Throws Stopped when told to stop; lose()
  /// must follow.
  FrontState update(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                    NarrowPhase<Bounds>& narrow, const FrontInput& input, bool new_hierarchy);
  /// Instead: begins a step that keeps no front, because too many parts are near each other, and traverses a
  /// block of these from the root. traverse() returns its number of tests.
  FrontState begin_without(const ColliderOptions& options);
  std::uint64_t traverse(std::span<const Bvh<Bounds>> trees, std::span<const NearPair> near,
                         NarrowPhase<Bounds>& narrow, const FrontInput& input);
  /// Why a front in this state was rebuilt.
  Rebuild reason_of(FrontState state);

  /// The front is lost: the next step builds one.
  void lose(Rebuild why) noexcept;
  bool lost() const { return lost_; }
  /// What was found of stationary leaf pairs does not hold for the next questions, until done().
  void forget_answers() noexcept { answers_hold_ = false; }
  /// A step is complete.
  void done() noexcept { answers_hold_ = true; }

  Front<Bounds>& front() { return front_; }
  const Front<Bounds>& front() const { return front_; }

 private:
  Answers answers(const ColliderOptions& options) const;
  bool due_for_rebuild(const ColliderOptions& options) const;

  Front<Bounds> front_;
  bool lost_ = true;
  bool answers_hold_ = true;
  Rebuild lost_to_ = Rebuild::kNone;
  std::int64_t steps_since_build_ = -1;
  std::int64_t stalled_steps_ = 0;  // in which the front did not grow
};

}  // namespace warmfront
