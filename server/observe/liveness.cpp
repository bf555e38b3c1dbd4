// SPDX-License-Identifier: Apache-2.0
// Counting beats. Thread safety as stated in the header.
#include "server/observe/liveness.h"

#include <ctime>

namespace warmfront::server {
namespace {

constexpr std::chrono::milliseconds kBeat{900};
constexpr std::chrono::seconds kSilence{20};
constexpr int kMostBeatsWithoutProgress = 60;
/// What tickers and pings take at most between two beats; a step takes some hundred times as much.
constexpr std::chrono::milliseconds kIdle{10};

}  // namespace

void Liveness::beat(const Work& work, Clock::time_point now) {
  const Clock::time_point before{Clock::duration(last_beat_.load(std::memory_order_relaxed))};
  if (now - before < kBeat) return;
  const bool progress = !work.running || work.tasks_done != last_.tasks_done ||
                        work.processor_time - last_.processor_time > kIdle;
  beats_without_progress_ = progress ? 0 : beats_without_progress_ + 1;
  last_ = work;
  last_beat_ = now.time_since_epoch().count();
}

bool Liveness::alive(Clock::time_point now) const {
  const Clock::time_point last{Clock::duration(last_beat_.load(std::memory_order_relaxed))};
  return now - last < kSilence && beats_without_progress_ < kMostBeatsWithoutProgress;
}

std::chrono::nanoseconds Liveness::processor_time() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace warmfront::server
