// SPDX-License-Identifier: Apache-2.0
// A thread that waits. Thread safety as stated in the header.
#include "server/process/ticker.h"

#include <new>
#include <utility>

namespace warmfront::server {

Ticker::Ticker(std::chrono::milliseconds period, std::function<void()> tick)
    : period_(period), tick_(std::move(tick)), thread_([this](const std::stop_token& stop) { work(stop); }) {}

void Ticker::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, stop, period_, [&] { return stop.stop_requested(); })) {
    try {
      tick_();
    } catch (const std::bad_alloc&) {
      // The next tick may find memory.
    }
  }
}

}  // namespace warmfront::server
