// SPDX-License-Identifier: Apache-2.0
// Which frames are traced, and where their traces go. Thread-safe; frames never wait for it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "engine/result.h"
#include "server/observe/frame_trace.h"

namespace warmfront::server {

struct TraceSettings {
  std::string file;      ///< appended to, a request of OTLP's JSON a line; empty: none
  std::string endpoint;  ///< `http://HOST:PORT/v1/traces`, which is sent to; empty: none
  double sample = 0.01;  ///< the share of frames that is traced, of calls without a traceparent

  bool enabled() const { return !file.empty() || !endpoint.empty(); }
};

class Tracer {
 public:
  /// Traces wait here for the thread that sends them, a second at most; more are dropped, and counted.
  static constexpr std::size_t kMostWaiting = 4096;

  /// kInvalidArgument for an endpoint that is not of that form, and a file that cannot be opened. `warn` is
  /// told, a line a minute at most, what could not be sent.
  static Result<std::unique_ptr<Tracer>> start(const TraceSettings& settings,
                                               std::function<void(const std::string&)> warn);
  /// Sends what waits.
  ~Tracer();

  /// A trace that begins now; null where this frame is not to be traced: its caller's traceparent says so, or
  /// it has none and is not of the share. Never throws: without memory it is not traced.
  std::unique_ptr<FrameTrace> begin(const std::optional<TraceContext>& caller, const char* method,
                                    std::string_view session, std::uint64_t frame) noexcept;
  /// The frame is through. Null is ignored.
  void finish(std::unique_ptr<FrameTrace> trace) noexcept;

  /// To all places that there are; frames_dropped(): not to one of them at least.
  std::uint64_t frames_sent() const { return sent_.load(std::memory_order_relaxed); }
  std::uint64_t frames_dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  struct Impl;
  explicit Tracer(std::unique_ptr<Impl> impl);

  std::atomic<std::uint64_t> sent_{0};
  std::atomic<std::uint64_t> dropped_{0};
  const std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront::server
