// SPDX-License-Identifier: Apache-2.0
// Calls that take long, on another thread, while the one that waits looks for signals.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <future>

#include "engine/stop.h"

namespace warmfront::python {

using Clock = std::chrono::steady_clock;

/// Between two looks for signals.
inline constexpr std::chrono::milliseconds kLook{20};

/// A signal came, and Python's handler for it raised.
inline bool interrupted() {
  const pybind11::gil_scoped_acquire lock;
  return PyErr_CheckSignals() != 0;
}

enum class Ended : std::uint8_t { kDone, kInterrupted, kTimeUp };

/// Has another thread call f(stop), and waits for it without the interpreter's lock, but for a look at
/// signals. `stop` is set, and the reason returned, where a handler of these raises, at `until`, and where
/// `closed` is set. Throws what f() throws, but not Stopped, unless a handler raised, which is Python's error
/// then.
template <class F>
Ended run(F f, Clock::time_point until, const std::atomic<bool>* closed) {
  std::atomic<bool> stop{false};
  Ended ended = Ended::kDone;
  std::exception_ptr thrown;
  const auto give_up = [&](Ended why) {
    if (ended == Ended::kDone) ended = why;
    stop.store(true, std::memory_order_relaxed);
  };
  {
    const pybind11::gil_scoped_release unlocked;
    auto done = std::async(std::launch::async, [&] { f(stop); });
    for (;;) {
      const Clock::time_point look = Clock::now() + kLook;
      if (done.wait_until(ended == Ended::kDone ? std::min(until, look) : look) == std::future_status::ready)
        break;
      if (Clock::now() >= until) give_up(Ended::kTimeUp);
      if (closed != nullptr && closed->load(std::memory_order_relaxed))
        stop.store(true, std::memory_order_relaxed);
      if (ended != Ended::kInterrupted && interrupted()) {
        ended = Ended::kInterrupted;
        stop.store(true, std::memory_order_relaxed);
      }
    }
    try {
      done.get();
    } catch (const Stopped&) {
      // As it was told to.
    } catch (...) {
      thrown = std::current_exception();
    }
  }
  if (ended == Ended::kInterrupted) throw pybind11::error_already_set();
  if (thrown) std::rethrow_exception(thrown);
  return ended;
}

}  // namespace warmfront::python
