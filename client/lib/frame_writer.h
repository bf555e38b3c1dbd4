// SPDX-License-Identifier: Apache-2.0
// Frames onto a stream, in messages of a bounded size. Used by one thread at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

#include "client/lib/sent_frame.h"
#include "client/lib/step_stream.h"

namespace warmfront::client {

class FrameWriter {
 public:
  /// `chunk_bytes`: most bytes of positions in one message. `timeout`: of each message, as
  /// StepStream::write() has it. `answer_bytes`: of the room that each answer gets in memory that the daemon
  /// shares, where it does. `moved`: does it take what moved from there too? The stream outlives the writer.
  FrameWriter(StepStream& stream, std::size_t chunk_bytes, std::chrono::milliseconds timeout,
              std::size_t answer_bytes, bool moved)
      : stream_(stream),
        chunk_bytes_(chunk_bytes),
        timeout_(timeout),
        answer_bytes_(answer_bytes),
        shares_moved_(moved) {}

  /// Writes a first message of a frame whose positions are to follow: a daemon that wakes up meanwhile is
  /// there when they are. False where it was not taken.
  bool begin(std::uint64_t number, const Question& question);
  /// Writes all messages of the frame, and adds what they cost to it. False when the stream took one of them
  /// no more.
  bool write(SentFrame& frame);

 private:
  class Messages;

  /// Goes with the first message of a frame.
  std::optional<v1::Question> question_of(const SentFrame& frame) const;
  void give_room(SentFrame& frame, v1::StepFrame& step);
  /// Puts what moved into shared memory; false where it is to be in the frame's messages.
  bool share_moved(SentFrame& frame, v1::StepFrame& step);
  bool write_shared(Messages& to, std::uint64_t offset);
  bool write_commit(Messages& to);
  bool write_positions(Messages& to);
  bool write_moved(Messages& to);

  StepStream& stream_;
  const std::size_t chunk_bytes_;
  const std::chrono::milliseconds timeout_;
  const std::size_t answer_bytes_;
  const bool shares_moved_;
};

}  // namespace warmfront::client
