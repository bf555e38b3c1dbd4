// SPDX-License-Identifier: Apache-2.0
// A strand over the runner. Thread safety as stated in the header.
#include "server/session/mailbox.h"

#include <utility>

#include "server/session/step_cost.h"

namespace warmfront::server {

bool Mailbox::post(Job job) {
  {
    const MutexLock lock(mutex_);
    if (jobs_.size() >= capacity_) return false;
    if (!push_locked(std::move(job))) return true;
  }
  schedule();
  return true;
}

void Mailbox::post_always(Job job) {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(std::move(job))) return;
  }
  schedule();
}

void Mailbox::run_or_post(Job job) {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(std::move(job))) return;
  }
  if (!is_brief(ms_.load(std::memory_order_relaxed)) ||
      !runner_.run_here([self = shared_from_this()] { self->run_turn(); },
                        lane_.load(std::memory_order_relaxed)))
    schedule();
}

bool Mailbox::push_locked(Job job) {
  jobs_.push_back(std::move(job));
  return !std::exchange(scheduled_, true);
}

void Mailbox::schedule() {
  runner_.post([self = shared_from_this()] { self->run_turn(); }, lane_.load(std::memory_order_relaxed));
}

void Mailbox::run_turn() {
  double turn_ms = 0;
  do {
    turn_ms += ms_.load(std::memory_order_relaxed);
    // Scoped, so that what the job holds is released before the next is looked for.
    {
      UniqueLock lock(mutex_);
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      job();
    }
    const MutexLock lock(mutex_);
    scheduled_ = !jobs_.empty();
    if (!scheduled_) return;
  } while (is_brief(turn_ms + ms_.load(std::memory_order_relaxed)));
  schedule();
}

}  // namespace warmfront::server
