// SPDX-License-Identifier: Apache-2.0
// Runs lanes in parallel, and the clock. Thread safety as stated in the header.
#include "client/cli/load/run.h"

#include <sys/resource.h>

#include <algorithm>
#include <latch>
#include <memory>
#include <thread>
#include <vector>

#include "client/cli/load/lane.h"

namespace warmfront::client::load {
namespace {

using Clock = Lane::Clock;

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Processor seconds that this process has used.
double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Second sum_up(std::vector<std::unique_ptr<Lane>>& lanes, double at, double length) {
  Interval all;
  for (const auto& lane : lanes) all.merge(lane->take_interval());
  return {at,
          length,
          all.latency.count(),
          all.contacts,
          all.errors,
          all.latency.quantile(0.5),
          all.latency.quantile(0.99)};
}

}  // namespace

Result<Measured> run(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected,
                     const std::function<void(const Second&)>& each_second, const std::atomic<bool>& stop) {
  std::vector<std::unique_ptr<Lane>> lanes;
  for (std::uint32_t i = 0; i < plan.sessions; ++i)
    lanes.push_back(std::make_unique<Lane>(plan, playback, expected, i));
  std::latch ready(plan.sessions), go(1), ended(plan.sessions);
  Clock::time_point start;  // written before `go`
  std::vector<std::jthread> threads;
  for (const auto& lane : lanes)
    threads.emplace_back([&, lane = lane.get()] {
      lane->prepare();
      ready.count_down();
      go.wait();
      lane->run(start, stop);
      ended.count_down();
    });
  ready.wait();
  const bool none =
      std::ranges::all_of(lanes, [](const auto& lane) { return lane->tally().all_frames == 0; });
  for (const auto& lane : lanes) static_cast<void>(lane->take_interval());  // the cold frames
  start = Clock::now();
  if (none) start -= std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(plan.end()));
  go.count_down();
  if (none) {
    threads.clear();
    return *lanes.front()->failure();
  }

  Measured measured;
  measured.plan = plan;
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  double processor = 0, from = -1, last = 0;
  while (!ended.try_wait()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double now = elapsed();
    if (from < 0 && now >= plan.measured_from()) {
      from = now;
      processor = processor_seconds();
    }
    if (now - last < 1) continue;
    measured.series.push_back(sum_up(lanes, now, now - last));
    each_second(measured.series.back());
    last = now;
  }
  const double now = elapsed();
  if (now - last > 0.05) measured.series.push_back(sum_up(lanes, now, now - last));
  threads.clear();
  measured.interrupted = stop;
  measured.seconds = std::clamp(now - plan.measured_from(), 0.0, plan.duration);
  if (from >= 0 && now > from) measured.client_cpu_cores = (processor_seconds() - processor) / (now - from);
  for (const auto& lane : lanes) {
    measured.tally.merge(lane->tally());
    if (lane->has_session() || !lane->failure()) continue;
    ++measured.sessions_missing;
    measured.why_missing = lane->failure()->message;
  }
  return measured;
}

}  // namespace warmfront::client::load
