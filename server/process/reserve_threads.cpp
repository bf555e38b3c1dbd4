// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "server/process/reserve_threads.h"

#include <algorithm>

namespace warmfront::server {
namespace {

/// A thread ends its turn at the latest then, with nothing done.
constexpr std::chrono::milliseconds kLook{1000};
/// How often the reserve looks around while anyone is at work; and while nobody is.
constexpr std::chrono::milliseconds kGlance = ReserveThreads::kLong, kSleepy{250};

}  // namespace

void ReserveThreads::begin() {
  for (Hand& hand : hands_)
    threads_.emplace_back([this, &hand] {
      while (turn_(hand, kLook)) continue;
    });
  threads_.emplace_back([this] { stand_by(); });
}

void ReserveThreads::join() noexcept {
  {
    const MutexLock lock(mutex_);
    ends_ = true;
  }
  ended_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

std::size_t ReserveThreads::at_work_for(std::chrono::milliseconds least) const noexcept {
  const Clock::rep until = (Clock::now() - least).time_since_epoch().count();
  return static_cast<std::size_t>(std::ranges::count_if(
      hands_, [&](const Hand& hand) { return hand.since_.load(std::memory_order_relaxed) <= until; }));
}

void ReserveThreads::stand_by() noexcept {
  Hand own;
  for (;;) {
    {
      UniqueLock lock(mutex_);
      const auto pause = at_work_for(std::chrono::milliseconds(0)) > 0 ? kGlance : kSleepy;
      if (!ends_) ended_.wait_for(lock, pause);
      if (ends_) return;
    }
    while (at_work_for(kLong) == hands_.size())
      if (!turn_(own, kLong)) return;
  }
}

}  // namespace warmfront::server
