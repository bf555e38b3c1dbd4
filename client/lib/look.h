// SPDX-License-Identifier: Apache-2.0
// Waiting for gRPC that a caller may end. Used by one thread at a time.
#pragma once

#include <grpcpp/completion_queue.h>

#include <algorithm>
#include <chrono>
#include <functional>

namespace warmfront::client {

/// Any time of waiting, however long.
inline std::chrono::system_clock::time_point deadline_after(std::chrono::nanoseconds time) {
  const auto now = std::chrono::system_clock::now();
  return now + std::min(time, std::chrono::system_clock::time_point::max() - now);
}
inline std::chrono::system_clock::time_point deadline_after(std::chrono::milliseconds time) {
  using std::chrono::nanoseconds;
  const bool endless = time > std::chrono::duration_cast<std::chrono::milliseconds>(nanoseconds::max());
  return deadline_after(endless ? nanoseconds::max() : nanoseconds(time));
}

/// Called while something is waited for. Returns when to be called again, and throws to end the waiting.
using Look = std::function<std::chrono::system_clock::time_point()>;

/// The queue's next event; false when there is none by the deadline. What is there already is taken before
/// `look`, which may be empty, is called.
inline bool next_event(grpc::CompletionQueue& queue, void*& done, bool& ok,
                       std::chrono::system_clock::time_point deadline, const Look& look) {
  using Time = std::chrono::system_clock::time_point;
  Time until = look ? Time() : deadline;
  for (;;) {
    if (queue.AsyncNext(&done, &ok, until) == grpc::CompletionQueue::GOT_EVENT) return true;
    if (until >= deadline) return false;
    until = std::min(deadline, look());
  }
}

}  // namespace warmfront::client
