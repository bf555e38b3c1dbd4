// SPDX-License-Identifier: Apache-2.0
// Forgets sessions that nobody has used for a while. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "server/session/store.h"

namespace warmfront::server {

/// A thread that closes sessions without a stream and idle for `timeout`, and tells `expired` of each. It
/// stops when destroyed. `store` outlives it.
class Expiry {
 public:
  Expiry(Store& store, std::chrono::milliseconds timeout, std::function<void(const Session&)> expired);

 private:
  void work(const std::stop_token& stop);

  // Constant after construction.
  Store& store_;
  const std::chrono::milliseconds timeout_;
  const std::function<void(const Session&)> expired_;

  std::mutex mutex_;  // of the wait only; protects nothing
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace warmfront::server
