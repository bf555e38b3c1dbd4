// SPDX-License-Identifier: Apache-2.0
// A collider as the verbs use it, in this process or behind a daemon. A stepper is used by one thread at a
// time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "client/cli/frames/replaced_bodies.h"
#include "client/io/contact_record.h"
#include "engine/collider.h"
#include "engine/options.h"
#include "engine/result.h"
#include "engine/scene.h"
#include "engine/statistics.h"

namespace warmfront::client {

/// One step's answer, owned: it outlives the step.
struct StepAnswer {
  std::uint64_t vf = 0;                ///< vertex-face contacts
  std::uint64_t ee = 0;                ///< edge-edge contacts
  std::uint64_t vh = 0;                ///< vertex-half-space contacts
  std::uint64_t possible = 0;          ///< of all kinds, those neither proved nor excluded
  std::optional<double> earliest_toi;  ///< least toi of the step; none without contacts
  /// In the engine's order; empty for Report::kCount.
  std::vector<ContactRecord> contacts;
  std::vector<ContactGeometry> geometry;  ///< of each contact, when any of options.fields is asked for
  StepStatistics statistics;
  std::optional<StepStatistics> all_deformable;  ///< with options.explain
};

/// Steps from frame to frame. Created with a scene and the positions of frame 0.
class Stepper {
 public:
  virtual ~Stepper() = default;

  /// Tests the motion to the positions of `frame`. Fails as Collider::step() does; a remote stepper also with
  /// errors of its connection.
  virtual Result<StepAnswer> step(const Frame& frame) = 0;

  /// Most steps that may be submitted with submit() and unanswered; 1: submit() gains nothing.
  virtual std::size_t window() const { return 1; }
  /// Submits a step; next_answer() returns its answer, in order. `frame` need not outlive the call.
  virtual Status submit(const Frame& frame) {
    answers_.push_back(step(frame));
    return {};
  }
  /// The answer to the oldest submitted step, of which there must be one.
  virtual Result<StepAnswer> next_answer() {
    Result<StepAnswer> answer = std::move(answers_.front());
    answers_.pop_front();
    return answer;
  }

  /// Puts everything where the frame says, without a motion, as Collider::place() does, and fails as it does.
  /// All steps that were submitted are answered.
  virtual Status place(const Frame& frame) = 0;

  /// Puts the bodies' new meshes in place of theirs, and everything at these positions, (n, 3) of the new
  /// scene, without a motion. All steps that were submitted are answered. Fails as Collider::change() and
  /// place() do.
  virtual Status replace(std::vector<ReplacedBody> bodies, const Positions& positions) = 0;

  /// Number of threads that compute answers.
  virtual int threads() const = 0;

 private:
  std::deque<Result<StepAnswer>> answers_;
};

/// A stepper in this process. `threads` >= 1, or 0 for as many as the machine has. Fails as Scene::create()
/// and Collider::create() do.
Result<std::unique_ptr<Stepper>> make_local_stepper(const SceneDescription& scene, const Positions& positions,
                                                    const ColliderOptions& options, int threads);

}  // namespace warmfront::client
