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
  /// StepStream::write() has it. The stream outlives the writer.
  FrameWriter(StepStream& stream, std::size_t chunk_bytes, std::chrono::milliseconds timeout)
      : stream_(stream), chunk_bytes_(chunk_bytes), timeout_(timeout) {}

  /// Writes all messages of the frame, and adds what they cost to it. False when the stream took one of them
  /// no more.
  bool write(SentFrame& frame);

 private:
  class Messages;

  bool write_commit(Messages& to);
  bool write_positions(Messages& to);
  bool write_moved(Messages& to);

  StepStream& stream_;
  const std::size_t chunk_bytes_;
  const std::chrono::milliseconds timeout_;
};

}  // namespace warmfront::client
