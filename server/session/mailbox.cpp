// SPDX-License-Identifier: Apache-2.0
// A strand over the runner. Thread safety as stated in the header.
#include "server/session/mailbox.h"

#include <utility>

namespace warmfront::server {

bool Mailbox::post(Job job) {
  std::unique_lock lock(mutex_);
  if (jobs_.size() >= capacity_) return false;
  push(std::move(job), lock);
  return true;
}

void Mailbox::post_always(Job job) {
  std::unique_lock lock(mutex_);
  push(std::move(job), lock);
}

void Mailbox::push(Job job, std::unique_lock<std::mutex>& lock) {
  jobs_.push_back(std::move(job));
  if (std::exchange(scheduled_, true)) return;
  lock.unlock();
  runner_.post([self = shared_from_this()] { self->run_one(); }, lane_.load(std::memory_order_relaxed));
}

void Mailbox::run_one() {
  {
    std::unique_lock lock(mutex_);
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
  }
  const std::lock_guard lock(mutex_);
  scheduled_ = !jobs_.empty();
  if (scheduled_)
    runner_.post([self = shared_from_this()] { self->run_one(); }, lane_.load(std::memory_order_relaxed));
}

}  // namespace warmfront::server
