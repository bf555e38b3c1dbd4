// SPDX-License-Identifier: Apache-2.0
// A frame or a commit on its way to the daemon. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "client/lib/frame_bytes.h"
#include "engine/question.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::client {

class PendingAnswer;

/// A frame as it travels: the fields of v1::StepFrame, or of v1::Commit.
struct SentFrame {
  std::uint64_t number = 0;
  Question question = {};
  std::optional<double> commit = std::nullopt;  ///< of the trial before, up to this fraction: no positions
  /// A trial that was answered, sent again for the commit after it: nobody waits for its answer.
  bool answered = false;
  FrameBytes positions;                            ///< all of them, which messages under way refer to, ...
  std::optional<v1::MovedParts> moved;             ///< ... or what moved
  std::shared_ptr<PendingAnswer> asked = nullptr;  ///< who gets the answer
  // In memory that the daemon sees, until the answer: a copy of what moved, and where the answer may be put.
  std::optional<SharedRegion::Block> moved_block = std::nullopt;
  std::optional<SharedRegion::Block> answer_room = std::nullopt;
  // Cost so far.
  double encode_ms = 0;
  std::uint64_t sent_bytes = 0;

  /// Else the session stays where it is.
  bool counts() const { return commit || question.counts(); }
  /// A trial that may be committed, and what is about the last of them.
  bool is_trial() const {
    return !commit && (question.kind == QuestionKind::kTrial || question.kind == QuestionKind::kMaxStep);
  }
  bool needs_trial() const { return commit || (question.of_state() && question.where == Where::kTrialEnd); }
};

}  // namespace warmfront::client
