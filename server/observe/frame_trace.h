// SPDX-License-Identifier: Apache-2.0
// When a frame passed each place of its way through the daemon, from its first message to the last byte of
// its answer. Plain value, of constant size: nothing is allocated on the way. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

#include "engine/statistics.h"
#include "proto/wire/trace_context.h"

namespace warmfront::server {

using wire::SpanId;
using wire::TraceContext;

struct FrameTrace {
  using Clock = std::chrono::steady_clock;

  TraceContext context;
  SpanId span{};  ///< of the frame as a whole
  std::array<char, 37> session{};
  const char* method = "";  ///< a literal: "StreamSteps" or "Step"
  std::uint64_t frame = 0;

  std::chrono::system_clock::time_point started = std::chrono::system_clock::now();
  Clock::time_point received = Clock::now();  ///< its first message, at the same time
  Clock::time_point arrived = received;       ///< its last message
  Clock::time_point begun = received;         ///< its turn in its session
  Clock::time_point computed = received;      ///< its answer is there
  Clock::time_point encoded = received;       ///< the first message of that
  Clock::time_point sent = received;          ///< the last one is taken by the transport

  StageTimes stages_ms;
  std::uint64_t rows = 0;
  std::int32_t code = 0;  ///< google.rpc.Code
  /// Of a frame that failed: its error's message, or as much of its beginning as there is room for.
  std::array<char, 256> message{};

  void set_session(std::string_view id) {
    std::copy_n(id.begin(), std::min(id.size(), session.size() - 1), session.begin());
  }
  void set_message(std::string_view words) {
    std::copy_n(words.begin(), std::min(words.size(), message.size() - 1), message.begin());
  }
};

}  // namespace warmfront::server
