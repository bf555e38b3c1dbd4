// SPDX-License-Identifier: Apache-2.0
// A step, from a frame to its contacts, stage by stage. Used by one thread at a time.
#pragma once

#include <memory>
#include <span>

#include "engine/frame.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/state/core.h"
#include "engine/state/core_replacement.h"
#include "engine/step_result.h"
#include "engine/stop.h"

namespace warmfront {

/// What becomes of a motion that was answered: it is where everything stands from now on, or was a question;
/// kAgain: another question about the motion of the last trial.
enum class Kind : std::uint8_t { kStep, kTrial, kAgain };

/// The pipeline, in the order of DESIGN section 2; one implementation for each kind of bounds. One may take
/// over from another between steps.
class Pipeline {
 public:
  virtual ~Pipeline() = default;
  /// Carries out a frame that was checked, by core.options, if `accept` accepts its answer. Kind::kAgain
  /// takes no frame.
  virtual Result<StepResult> step(Core& core, const Frame& frame, Kind kind, StopSignal stop,
                                  const AcceptStep& accept) = 0;
  /// Takes the last trial up to a fraction in [0, 1]. After a trial only.
  virtual void commit(Core& core, double fraction, Rounding rounding) noexcept = 0;
  /// Carries out a frame that was checked, without a motion, if `accept` accepts `result`, which tells of
  /// nothing. Throws Stopped when told to stop; after an error or exception everything stands where it did.
  virtual Status place(Core& core, const Frame& frame, StopSignal stop, const StepResult& result,
                       const AcceptStep& accept) = 0;
  /// core.options are others than in the last step, in what they say of contacts.
  virtual void options_changed(Core& core) = 0;
  /// Parts were added or changed: which are near each other is found anew.
  virtual void parts_changed() = 0;
  /// The hierarchy of a part that is about to change, for what will be left of it; none where another one is
  /// due.
  virtual HeldOrder hierarchy_of(const Core& core, PartId part) const = 0;
  /// Parts were replaced, which the core has taken; what became of each, which is used up.
  virtual void parts_replaced(Core& core, std::span<PartChange> changes) noexcept = 0;
  /// Vertices that were there are thicker, or thinner: what budgets, bounds and answers were made for.
  virtual void thickness_changed(Core& core) noexcept = 0;
  /// Bodies are at other poses, where no motion led: nothing that was made for where they were holds.
  virtual void poses_set(Core& core) noexcept = 0;
  /// Filters have other patches: what traversals left out by them may count now.
  virtual void patches_changed(Core& core) noexcept = 0;
  /// The kind that the next step uses.
  virtual BoundsKind bounds() const = 0;
  /// See self_check(); passes when the next step will make all of it anew anyway. Throws Stopped when told to
  /// stop.
  virtual Status self_check(const Core& core, StopSignal stop) = 0;
  /// Forgets all that is kept for speed: the next step is a cold one.
  virtual void forget(Core& core) = 0;
  virtual std::size_t memory_bytes() const = 0;
};

/// For kAabb and kKDop18; see auto_bounds.h.
std::unique_ptr<Pipeline> make_pipeline(BoundsKind bounds);

}  // namespace warmfront
