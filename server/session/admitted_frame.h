// SPDX-License-Identifier: Apache-2.0
// A frame on its way through a session: what it asks, what it holds until it is computed, and who is told
// what becomes of it. Used by one thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <variant>

#include "engine/question.h"
#include "server/fault.h"
#include "server/session/answer.h"
#include "server/session/frame_buffer.h"
#include "server/session/frame_pass.h"

namespace warmfront::server {

using FrameOutcome = Outcome<std::shared_ptr<const Answer>>;

/// Told what becomes of one frame, by the thread that carries it out.
class FrameObserver {
 public:
  FrameObserver() = default;
  virtual ~FrameObserver() = default;
  FrameObserver(const FrameObserver&) = delete;
  FrameObserver& operator=(const FrameObserver&) = delete;

  /// The frame's turn has come. Not told of a frame that is refused because too many wait, or whose session
  /// was closed. Where this throws, the frame is not carried out, and its answer says why.
  virtual void begins() {}
  /// Exactly once, and last: what the frame held was given back.
  virtual void answered(const FrameOutcome& outcome) noexcept = 0;
};

/// What is asked of which positions.
struct FrameQuestion {
  FrameBuffer contents;
  Question question = {};
  friend bool operator==(const FrameQuestion&, const FrameQuestion&) = default;
};
/// The last trial is taken, up to this fraction of its way.
struct FrameCommit {
  double fraction;
  friend bool operator==(const FrameCommit&, const FrameCommit&) = default;
};
/// By which a frame is told from another one of its number.
using FrameContent = std::variant<FrameQuestion, FrameCommit>;

struct AdmittedFrame {
  std::uint64_t number;
  FrameContent content;
  FramePass pass;
  std::unique_ptr<FrameObserver> observer;
  std::chrono::steady_clock::time_point arrived = std::chrono::steady_clock::now();

  /// Null for a commit.
  FrameQuestion* question() { return std::get_if<FrameQuestion>(&content); }
  const FrameQuestion* question() const { return std::get_if<FrameQuestion>(&content); }
  /// Does the session then stand at its end?
  bool counts() const { return question() == nullptr || question()->question.counts(); }
  /// Has it a motion, which takes the place of the last trial where it fails?
  bool moves() const { return question() != nullptr && !question()->question.of_state(); }
};

}  // namespace warmfront::server
