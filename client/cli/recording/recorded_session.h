// SPDX-License-Identifier: Apache-2.0
// A recording as a sequence of a session's events. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/io/mesh.h"
#include "engine/collider.h"
#include "engine/result.h"
#include "proto/recording/reader.h"

namespace warmfront::client {

struct RecordedStep {
  std::uint64_t frame = 0;
  std::vector<v1::StepFrame> parts;  ///< as they were sent; at least one, or ...
  std::optional<v1::Commit> commit;  ///< ... of the last trial, up to a fraction
  /// None where the recording was cut off while the step was computed.
  std::optional<v1::RecordedAnswer> answer;

  /// Else the session stays where it is, whatever the answer.
  bool counts() const {
    if (commit) return true;
    const v1::Question::Kind kind = parts.front().question().kind();
    return kind == v1::Question::KIND_UNSPECIFIED || kind == v1::Question::KIND_STEP ||
           kind == v1::Question::KIND_PLACE;
  }
  /// Is everything put where it is, without a motion?
  bool places() const { return !commit && parts.front().question().kind() == v1::Question::KIND_PLACE; }
};
struct RecordedChange {
  v1::ChangeSceneRequest request;
  std::optional<v1::RecordedOutcome> outcome;  ///< as a step's answer
};
using RecordedEvent = std::variant<RecordedStep, RecordedChange>;

class RecordedSession {
 public:
  /// Reads the upload. kInvalidArgument for an invalid recording, and for an upload that is missing or
  /// inconsistent; the message names the path and the byte.
  static Result<RecordedSession> open(const std::string& path);

  const std::string& path() const { return reader_.path(); }
  const v1::RecordingHeader& header() const { return reader_.header(); }
  const v1::SessionHeader& session() const { return session_; }
  bool float32() const { return session_.dtype() == v1::DTYPE_FLOAT32; }
  const SceneDescription& scene() const { return scene_; }
  const ColliderOptions& options() const { return options_; }
  /// At session().first_frame(); for rigid bodies with a pose, their reference shapes.
  const PositionBuffer& positions() const { return positions_; }
  const std::vector<BodyPose>& poses() const { return poses_; }

  /// The next event; none at the end. kInvalidArgument as open().
  Result<std::optional<RecordedEvent>> next();
  /// At the end: a description of the recording's defect; empty if it is complete.
  std::string defect() const;

 private:
  explicit RecordedSession(recording::Reader reader) : reader_(std::move(reader)) {}
  Status read_upload();
  Status advance();
  Result<std::optional<RecordedEvent>> read_step();
  Result<std::optional<RecordedEvent>> read_commit();
  Result<std::optional<RecordedEvent>> with_answer(RecordedStep step);

  recording::Reader reader_;
  std::uint64_t record_at_ = 0;              // begin of next_
  std::optional<v1::RecordedMessage> next_;  // read but not yet used
  std::optional<v1::RecordingEnd> end_;
  bool cut_off_ = false;  // a step or change has no outcome
  v1::SessionHeader session_;
  SceneDescription scene_;
  ColliderOptions options_;
  PositionBuffer positions_;
  std::vector<BodyPose> poses_;
};

}  // namespace warmfront::client
