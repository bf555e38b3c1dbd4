// SPDX-License-Identifier: Apache-2.0
// A strand over the runner. Thread safety as stated in the header.
#include "server/session/mailbox.h"

#include <utility>

namespace warmfront::server {

Mailbox::Entry Mailbox::prepare(Job job, Kind kind) {
  Entry entry;
  entry.job.push_back({std::move(job), kind});
  entry.turn.emplace_back([self = shared_from_this()] { return self->run_turn(); }, share_);
  return entry;
}

bool Mailbox::post(Job job, Kind kind) {
  Entry entry = prepare(std::move(job), kind);
  {
    const MutexLock lock(mutex_);
    if (jobs_.size() >= capacity_) return false;
    if (!push_locked(entry)) return true;
  }
  runner_.post(std::move(entry.turn), lane_.load(std::memory_order_relaxed));
  return true;
}

void Mailbox::post_always(Entry entry) noexcept {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(entry)) return;
  }
  runner_.post(std::move(entry.turn), lane_.load(std::memory_order_relaxed));
}

void Mailbox::run_or_post(Entry step, Here here) noexcept {
  {
    const MutexLock lock(mutex_);
    if (!push_locked(step)) return;
  }
  const Lane lane = lane_.load(std::memory_order_relaxed);
  const double ms = ms_.load(std::memory_order_relaxed);
  const bool may = here == Here::kShort ? ms != kUnforeseen && lane == Lane::kShort : is_brief(ms);
  const Guest guest = here == Here::kShort ? Guest::kPacket : Guest::kReaction;
  if (!may || !runner_.run_here(step.turn, lane, guest, is_brief(ms)))
    runner_.post(std::move(step.turn), lane);
}

bool Mailbox::push_locked(Entry& entry) noexcept {
  jobs_.splice(jobs_.end(), entry.job);
  return !std::exchange(scheduled_, true);
}

double Mailbox::front_ms_locked() const {
  return jobs_.front().kind == Kind::kStep ? ms_.load(std::memory_order_relaxed) : kUnforeseen;
}

std::optional<Lane> Mailbox::run_turn() noexcept {
  double turn_ms = 0;
  for (;;) {
    // Scoped, so that what the job holds is released before the next is looked for.
    {
      std::list<Waiting> one;
      UniqueLock lock(mutex_);
      turn_ms += front_ms_locked();
      one.splice(one.begin(), jobs_, jobs_.begin());
      lock.unlock();
      one.front().job();
    }
    const MutexLock lock(mutex_);
    scheduled_ = !jobs_.empty();
    if (!scheduled_) return std::nullopt;
    if (!is_brief(turn_ms + front_ms_locked())) return lane_.load(std::memory_order_relaxed);
  }
}

}  // namespace warmfront::server
