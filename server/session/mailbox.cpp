// SPDX-License-Identifier: Apache-2.0
// A strand over the runner. Thread safety as stated in the header.
#include "server/session/mailbox.h"

#include <utility>

#include "server/session/step_cost.h"

namespace warmfront::server {

bool Mailbox::post(Job job, Kind kind) {
  {
    const MutexLock lock(mutex_);
    if (jobs_.size() >= capacity_) return false;
    if (!push_locked(std::move(job), kind)) return true;
  }
  schedule();
  return true;
}

void Mailbox::post_always(Job job, Kind kind) {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(std::move(job), kind)) return;
  }
  schedule();
}

void Mailbox::run_or_post(Job step) {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(std::move(step), Kind::kStep)) return;
  }
  if (!is_brief(ms_.load(std::memory_order_relaxed)) ||
      !runner_.run_here([self = shared_from_this()] { self->run_turn(); },
                        lane_.load(std::memory_order_relaxed)))
    schedule();
}

bool Mailbox::push_locked(Job job, Kind kind) {
  jobs_.push_back({std::move(job), kind});
  return !std::exchange(scheduled_, true);
}

double Mailbox::front_ms_locked() const {
  return jobs_.front().kind == Kind::kStep ? ms_.load(std::memory_order_relaxed) : kUnforeseen;
}

void Mailbox::schedule() {
  runner_.post([self = shared_from_this()] { self->run_turn(); }, lane_.load(std::memory_order_relaxed));
}

void Mailbox::run_turn() {
  double turn_ms = 0;
  for (;;) {
    // Scoped, so that what the job holds is released before the next is looked for.
    {
      UniqueLock lock(mutex_);
      turn_ms += front_ms_locked();
      const Job job = std::move(jobs_.front().job);
      jobs_.pop_front();
      lock.unlock();
      job();
    }
    const MutexLock lock(mutex_);
    scheduled_ = !jobs_.empty();
    if (!scheduled_) return;
    if (!is_brief(turn_ms + front_ms_locked())) break;
  }
  schedule();
}

}  // namespace warmfront::server
