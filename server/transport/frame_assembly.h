// SPDX-License-Identifier: Apache-2.0
// A frame as it is put together from the messages that carry it. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/session/session.h"
#include "server/transport/session_recording.h"
#include "server/transport/stream_codec.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// Of a message of StreamSteps that does not belong where it came.
Fault out_of_place(std::string message);

class FrameAssembly {
 public:
  /// Admits the frame by the gates, with room for all that it may bring: pass().refused says why not.
  /// `session` outlives it.
  FrameAssembly(Session& session, Gate& of_tenant, const Gate& of_daemon, std::uint64_t number);

  std::uint64_t number() const { return number_; }
  FramePass& pass() { return pass_; }

  /// What is asked, by the first message, of either kind. A question that is none is refused as what is too
  /// much is: in the frame's turn, so that answers keep their order.
  template <class Message>
  void ask(const Message& first);
  /// A fault of the protocol, for a further message that does not belong to this frame.
  std::optional<Fault> refusal_of(const v1::StepFrame& further) const;
  /// Has an earlier message brought positions, or what moved?
  bool has_begun() const { return contents_.has_begun(); }
  /// Takes a message's positions in, and the message into the session's recording, if there is one. What does
  /// not fit is kept for complete() to say; of a frame that is refused nothing is kept.
  void add(const StreamRequest& message);
  void add(const v1::StepRequest& message);

  /// The frame, and nothing is left here.
  AdmittedFrame finish(std::unique_ptr<FrameObserver> observer);
  RecordedParts take_parts() { return std::move(parts_); }

 private:
  /// Before a message's positions are appended.
  void expect_positions();

  SparePositions& spare_;
  const bool is_recorded_;
  const std::uint64_t number_;
  FrameBuffer contents_;
  bool has_positions_ = false;
  FramePass pass_;
  Question question_;
  RecordedParts parts_;
};

}  // namespace warmfront::server
