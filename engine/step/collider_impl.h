// SPDX-License-Identifier: Apache-2.0
// What a collider keeps: the warm scene, and of the last answers what a commit or the same question again
// needs. Used by one thread at a time, as the collider.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "engine/collider.h"
#include "engine/step/all_deformable.h"
#include "engine/step/warm_scene.h"

namespace warmfront {

inline Error was_cancelled() {
  return {ErrorCode::kCancelled, "the call was cancelled; it may be made again"};
}

inline Error keep_distance_is_of_max_step() {
  return invalid_argument("keep_distance: it is of max_step alone; give it with that question");
}

struct Collider::Impl {
  WarmScene warm;
  std::unique_ptr<AllDeformable> all_deformable = nullptr;  // with options.explain

  // What is kept of a trial's answer for its commit, besides the contacts.
  struct Trial {
    Report report = Report::kAll;
    KindCounts found;
    std::uint64_t possible = 0;
    std::optional<double> earliest_toi;
  };
  std::optional<Trial> last_trial = std::nullopt;

  // The last answer to a question about a state, while it holds.
  struct Known {
    ColliderOptions asked;
    StepResult answer;
  };
  std::optional<Known> known_state = std::nullopt;

  Result<StepResult> place(const Frame& frame, const Question& question, StopSignal stop,
                           const AcceptStep& accept);
  Result<StepResult> trial(const Frame& frame, const Question& question, StopSignal stop,
                           const AcceptStep& accept);
  Result<StepResult> ask_of_state(const ColliderOptions& options, StopSignal stop, const AcceptStep& accept);

  // A question that fails forgets the trial before it.
  struct Asking {
    explicit Asking(Impl& the_impl) : impl(the_impl) {}
    ~Asking() {
      if (!answered) impl.drop_trial();
    }
    Asking(const Asking&) = delete;
    Asking& operator=(const Asking&) = delete;

    Impl& impl;
    bool answered = false;
  };

  void drop_trial() noexcept {
    warm.drop_trial();
    last_trial.reset();
    if (known_state && known_state->asked.instant == Instant::kEnd) known_state.reset();
  }
  // Everything may be elsewhere from now on, or of another shape.
  void forget_answers() noexcept {
    drop_trial();
    known_state.reset();
  }

  // The core has moved or become another one.
  void restart_comparison() {
    if (all_deformable != nullptr) all_deformable->forget();
  }
};

}  // namespace warmfront
