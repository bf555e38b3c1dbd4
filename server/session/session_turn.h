// SPDX-License-Identifier: Apache-2.0
// A session's turn, around everything that is done to its collider. Private to the sources of Session.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <new>
#include <optional>

#include "server/session/session.h"

namespace warmfront::server {

/// The fault of a session whose engine failed. Never throws: without memory for the words it has fewer.
Fault engine_failed(const char* what, const char* why) noexcept;

/// A request that close() can stop, for as long as this lives.
class Session::Running {
 public:
  /// `given_up` is by the client; it may be null.
  Running(Session& session, std::atomic<bool>* given_up)
      : session_(session), stop_(given_up != nullptr ? *given_up : session.stop_) {
    const MutexLock lock(session_.mutex_);
    session_.running_ = &stop_;
    if (session_.closed_) stop_ = true;
  }
  ~Running() {
    const MutexLock lock(session_.mutex_);
    session_.running_ = nullptr;
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  const std::atomic<bool>* stop() const { return &stop_; }

 private:
  Session& session_;
  std::atomic<bool>& stop_;
};

template <class T, class Work>
Outcome<T> Session::guarded(const char* what, Work work) noexcept {
  forecast_.begins();
  const auto began = std::chrono::steady_clock::now();
  Outcome<T> outcome = [&]() -> Outcome<T> {
    try {
      if (std::optional<Fault> fault = closed()) return *std::move(fault);
      std::optional<Workers::OneThread> one_thread;
      if (runner_.takes_one_thread(forecast_.lane())) one_thread.emplace();
      return work();
    } catch (const std::bad_alloc&) {
      return no_memory(what);
    } catch (const std::exception& error) {
      return engine_failed(what, error.what());
    }
  }();
  if (!outcome && outcome.fault().engine_failed()) {
    close_as("was dropped after a failure of the engine");
    lost_(*this, outcome.fault());
    return outcome;
  }
  take_stock(std::chrono::steady_clock::now() - began);
  return outcome;
}

}  // namespace warmfront::server
