// SPDX-License-Identifier: Apache-2.0
// Counting calls and draining them. Thread safety as stated in the header.
#include "server/admin/lifecycle.h"

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

std::vector<std::shared_ptr<Drainable>> Lifecycle::streams() {
  const MutexLock lock(mutex_);
  std::vector<std::shared_ptr<Drainable>> streams;
  for (const auto& [key, call] : calls_)
    if (std::shared_ptr<Drainable> stream = call.lock()) streams.push_back(std::move(stream));
  return streams;
}

void Lifecycle::begin_drain(std::chrono::system_clock::time_point deadline) {
  {
    const MutexLock lock(mutex_);
    draining_ = true;
  }
  for (const std::shared_ptr<Drainable>& stream : streams()) stream->notify_draining(deadline);
}

void Lifecycle::end_streams() {
  for (const std::shared_ptr<Drainable>& stream : streams()) stream->end(draining_fault());
}

void Lifecycle::end_quiet_streams(std::chrono::milliseconds quiet) {
  for (const std::shared_ptr<Drainable>& stream : streams()) stream->end_if_quiet(draining_fault(), quiet);
}

void Lifecycle::enforce_timeouts() {
  const auto now = std::chrono::steady_clock::now();
  for (const std::shared_ptr<Drainable>& stream : streams()) stream->enforce_timeouts(now);
}

std::size_t Lifecycle::wait_until_idle(std::chrono::steady_clock::time_point deadline) {
  UniqueLock lock(mutex_);
  while (!calls_.empty())
    if (ended_.wait_until(lock, deadline) == std::cv_status::timeout) break;
  return calls_.size();
}

}  // namespace warmfront::server
