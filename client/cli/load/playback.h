// SPDX-License-Identifier: Apache-2.0
// A scene's frames played forward and backward endlessly, so that a session of any length has no jump.
// Constant once read; safe to share between threads.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/load/mix.h"
#include "client/cli/recording/answer_digest.h"
#include "client/io/input.h"
#include "engine/options.h"
#include "engine/result.h"

namespace warmfront::client::load {

class Playback {
 public:
  /// Reads all frames into memory; at least two. `scene`: the input's, or with other bodies.
  static Result<Playback> read(Input& input, SceneDescription scene);

  const SceneDescription& scene() const { return scene_; }
  std::size_t frame_count() const { return frames_.size(); }
  /// Number of ticks after which the positions repeat.
  std::uint64_t period() const { return 2 * (frames_.size() - 1); }
  /// The positions at a tick: frames 0, 1, ..., n - 1, n - 2, ..., 1, 0, 1, ...
  Positions at(std::uint64_t tick) const;

 private:
  Playback(SceneDescription scene, std::vector<PositionBuffer> frames)
      : scene_(std::move(scene)), frames_(std::move(frames)) {}
  SceneDescription scene_;
  std::vector<PositionBuffer> frames_;
};

/// The engine's answers, in this process, to what a mix asks at every tick of a playback. An answer depends
/// only on a motion's begin and end, or on the state, so these are right for every session, wherever it
/// starts.
class ExpectedAnswers {
 public:
  /// Steps through a whole period; slow. Frames give all positions, so all `send` modes except poses must
  /// agree. `distance`: of proximity questions.
  static Result<ExpectedAnswers> compute(const Playback& playback, const ColliderOptions& options,
                                         const Mix& mix, double distance);

  /// At `tick`, of the motion to the next one where it is about one. Of max_steps the time alone.
  const AnswerDigest& of(Asked asked, std::uint64_t tick) const {
    const std::vector<AnswerDigest>& digests = asked == Asked::kProximity       ? near_
                                               : asked == Asked::kMaxStep       ? limits_
                                               : asked == Asked::kIntersections ? tangles_
                                                                                : motions_;
    return digests[tick % motions_.size()];
  }

 private:
  ExpectedAnswers() = default;
  // By tick.
  std::vector<AnswerDigest> motions_;  // to the next tick
  std::vector<AnswerDigest> limits_;   // empty, like the next two, where the mix does not ask
  std::vector<AnswerDigest> near_;
  std::vector<AnswerDigest> tangles_;
};

}  // namespace warmfront::client::load
