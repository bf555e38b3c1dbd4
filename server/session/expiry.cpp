// SPDX-License-Identifier: Apache-2.0
// The idle sweep. Thread safety as stated in the header.
#include "server/session/expiry.h"

#include <algorithm>
#include <new>
#include <utility>

namespace warmfront::server {

Expiry::Expiry(Store& store, std::chrono::milliseconds timeout, std::function<void(const Session&)> expired)
    : store_(store),
      timeout_(timeout),
      expired_(std::move(expired)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

void Expiry::work(const std::stop_token& stop) {
  using std::chrono::milliseconds;
  // Often enough that a session outlives its timeout by a quarter at most.
  const milliseconds period = std::clamp(timeout_ / 4, milliseconds(10), milliseconds(10'000));
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, stop, period, [&] { return stop.stop_requested(); })) {
    try {
      for (const std::shared_ptr<Session>& session : store_.remove_idle(timeout_)) {
        session->close_as("expired");
        expired_(*session);
      }
    } catch (const std::bad_alloc&) {
      // The next look may find memory.
    }
  }
}

}  // namespace warmfront::server
