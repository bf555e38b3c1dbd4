// SPDX-License-Identifier: Apache-2.0
// A scene that is kept warm: what lasts from step to step, and the pipeline that steps it. Used by one thread
// at a time.
#pragma once

#include <atomic>
#include <memory>

#include "engine/frame.h"
#include "engine/options.h"
#include "engine/result.h"
#include "engine/state/core.h"
#include "engine/step/pipeline.h"
#include "engine/step_result.h"
#include "engine/workers.h"

namespace warmfront {

struct WarmScene {
  Core core;
  std::unique_ptr<Pipeline> pipeline;
  ColliderOptions asked = core.options;  ///< of the last question

  /// At rest at `positions`, which are checked. As Collider::create(), whose work this is; throws Stopped
  /// when told to stop.
  static Result<WarmScene> create(std::shared_ptr<const Scene> scene, const Positions& positions,
                                  const ColliderOptions& options, std::shared_ptr<Workers> workers,
                                  StopSignal stop);

  /// As Collider::step(), but that `frame` is not checked.
  Result<StepResult> step(const Frame& frame, StopSignal stop, const AcceptStep& accept = {}) {
    return ask(frame, Kind::kStep, core.options, stop, accept);
  }
  /// The same by other options, which are checked, and for a trial.
  Result<StepResult> ask(const Frame& frame, Kind kind, const ColliderOptions& options, StopSignal stop,
                         const AcceptStep& accept);
  /// Forgets a trial that was not committed: what needs to know where everything stands finds it there.
  void drop_trial() noexcept;

  std::size_t memory_bytes() const { return core.memory_bytes() + pipeline->memory_bytes(); }

 private:
  // Of distances that are kept: see KeptWindow.
  Result<StepResult> ask_in_turns(const Frame& frame, Kind kind, StopSignal stop, const AcceptStep& accept);
};

}  // namespace warmfront
