// SPDX-License-Identifier: Apache-2.0
// Counting calls and draining them. Thread safety as stated in the header.
#include "server/process/lifecycle.h"

#include <utility>

namespace warmfront::server {

Fault Lifecycle::draining_fault() {
  return {ErrorCode::kUnavailable, Reason::kDraining,
          "the daemon is draining and about to stop; try again, here or at another one"};
}

Lifecycle::Call::~Call() {
  if (lifecycle_ == nullptr) return;
  const MutexLock lock(lifecycle_->mutex_);
  lifecycle_->calls_.erase(key_);
  // Notified under the lock: the waiter may destroy the lifecycle as soon as it sees the last call gone.
  lifecycle_->ended_.notify_all();
}

Outcome<Lifecycle::Call> Lifecycle::begin(std::weak_ptr<Drainable> call) {
  const MutexLock lock(mutex_);
  if (draining_) return draining_fault();
  const std::uint64_t key = next_key_++;
  calls_.emplace(key, std::move(call));
  return Call(*this, key);
}

bool Lifecycle::draining() const {
  const MutexLock lock(mutex_);
  return draining_;
}

template <class Work>
void Lifecycle::each_stream(Work work) {
  std::uint64_t next = 0;
  for (;;) {
    std::shared_ptr<Drainable> stream;
    {
      const MutexLock lock(mutex_);
      const auto found = calls_.lower_bound(next);
      if (found == calls_.end()) return;
      next = found->first + 1;
      stream = found->second.lock();
    }
    if (stream) work(*stream);
  }
}

void Lifecycle::begin_drain(std::chrono::system_clock::time_point deadline) {
  {
    const MutexLock lock(mutex_);
    draining_ = true;
  }
  each_stream([&](Drainable& stream) { stream.notify_draining(deadline); });
}

void Lifecycle::end_streams() {
  const Fault fault = draining_fault();
  each_stream([&](Drainable& stream) { stream.end(fault); });
}

void Lifecycle::end_quiet_streams(std::chrono::milliseconds quiet) {
  const Fault fault = draining_fault();
  each_stream([&](Drainable& stream) { stream.end_if_quiet(fault, quiet); });
}

void Lifecycle::give_up_streams() {
  const Fault fault = draining_fault();
  each_stream([&](Drainable& stream) { stream.give_up(fault); });
}

void Lifecycle::enforce_timeouts() {
  const auto now = std::chrono::steady_clock::now();
  each_stream([&](Drainable& stream) { stream.enforce_timeouts(now); });
}

void Lifecycle::enforce_rights() {
  each_stream([](Drainable& stream) { stream.enforce_rights(); });
}

std::size_t Lifecycle::wait_until_idle(std::chrono::steady_clock::time_point deadline) {
  UniqueLock lock(mutex_);
  while (!calls_.empty())
    if (ended_.wait_until(lock, deadline) == std::cv_status::timeout) break;
  return calls_.size();
}

}  // namespace warmfront::server
