// SPDX-License-Identifier: Apache-2.0
// Records a session that this process steps, locally or on a daemon. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/detect/stepper.h"
#include "client/cli/recording/answer_digest.h"
#include "client/lib/scene_state.h"
#include "engine/question.h"
#include "proto/recording/writer.h"

namespace warmfront::client {

class Recorder {
 public:
  /// Creates `path`, which must not exist, and writes the upload: of a session that was created at
  /// `positions` and then put where `placed` says, before its first step. A later write error stops the
  /// recording with a warning on stderr. Without a frame there is nothing to replay: the file is then
  /// removed.
  static Result<Recorder> create(const std::string& path, const SceneDescription& scene,
                                 const Positions& positions, const ColliderOptions& options,
                                 const Frame& placed = {});

  ~Recorder();
  Recorder(Recorder&&) noexcept = default;
  Recorder& operator=(Recorder&&) = delete;

  /// Call it before the step, so that a frame that crashes the process is recorded. Frames are numbered from
  /// 1.
  void frame(std::uint64_t number, const Frame& frame, const Question& question = {});
  void answer(std::uint64_t number, const AnswerDigest& digest);
  void refusal(std::uint64_t number, const Error& error);
  /// Bodies have other meshes from frame `next` on, at their rows of `positions`. Call it before the change.
  void change(std::uint64_t next, const std::vector<ReplacedBody>& bodies, const Positions& positions);
  void changed(const Status& status);

 private:
  Recorder(std::unique_ptr<recording::Writer> writer, SceneState state)
      : writer_(std::move(writer)), state_(std::move(state)) {}

  std::unique_ptr<recording::Writer> writer_;
  bool has_frames_ = false;
  SceneState state_;  // encodes frames; its positions stay at the first, or what the last change brought
};

/// `inner` with recording.
std::unique_ptr<Stepper> make_recording_stepper(std::unique_ptr<Stepper> inner, Recorder recorder);

}  // namespace warmfront::client
