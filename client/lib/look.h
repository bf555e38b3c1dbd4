// SPDX-License-Identifier: Apache-2.0
// Waiting for gRPC that a caller may end. Used by one thread at a time.
#pragma once

#include <grpcpp/completion_queue.h>

#include <algorithm>
#include <chrono>
#include <functional>

namespace warmfront::client {

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
