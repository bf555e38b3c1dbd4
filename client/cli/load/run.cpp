// SPDX-License-Identifier: Apache-2.0
// Runs lanes in parallel, and the clock. Thread safety as stated in the header.
#include "client/cli/load/run.h"

#include <sys/resource.h>

#include <algorithm>
#include <latch>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
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

/// The lanes, from when they start.
class Lanes {
 public:
  Lanes(const std::vector<std::unique_ptr<Lane>>& lanes, Clock::time_point start)
      : lanes_(lanes), start_(start) {}

  /// Seconds from the start; less than 0 before it.
  double at(Clock::time_point time) const { return std::chrono::duration<double>(time - start_).count(); }

  /// What happened in the `length` seconds until `at`, and the latencies.
  std::pair<Second, Histogram> sum_up(double at, double length) const {
    Interval all;
    Second second{.at = at, .seconds = length, .unserved_since = at};
    for (const auto& lane : lanes_) {
      all.merge(lane->take_interval());
      const std::optional<Unserved> unserved = lane->unserved();
      if (!unserved) continue;
      ++(unserved->why == Unserved::Why::kNoDaemon ? second.without_daemon : second.refused);
      second.unserved_since = std::clamp(this->at(unserved->since), 0.0, second.unserved_since);
    }
    second.frames = all.latency.count();
    second.contacts = all.contacts;
    second.errors = all.errors;
    second.p50_ms = all.latency.quantile(0.5);
    second.p99_ms = all.latency.quantile(0.99);
    return {second, std::move(all.latency)};
  }

  /// Since when no session is served, in seconds from the start; empty while one is.
  std::optional<double> none_served_since() const {
    double since = 0;
    for (const auto& lane : lanes_) {
      const std::optional<Unserved> unserved = lane->unserved();
      if (!unserved) return std::nullopt;
      since = std::max(since, at(unserved->since));
    }
    return since;
  }

 private:
  const std::vector<std::unique_ptr<Lane>>& lanes_;
  const Clock::time_point start_;
};

}  // namespace

Result<Measured> run(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected,
                     const std::function<void(const Second&, const Histogram& latency)>& each_second,
                     const std::atomic<bool>& stop) {
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
  const Lanes all(lanes, start);
  const auto elapsed = [&] { return all.at(Clock::now()); };
  double processor = 0, from = -1, last = 0, looked_at = plan.measured_from();
  while (!ended.try_wait()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double now = elapsed();
    if (from < 0 && now >= plan.measured_from()) {
      from = now;
      processor = processor_seconds();
    }
    if (const std::optional<double> since = all.none_served_since())
      measured.unserved_seconds += std::max(0.0, std::min(now, plan.end()) - std::max(*since, looked_at));
    looked_at = std::max(now, looked_at);
    if (now - last < 1) continue;
    const auto [second, latency] = all.sum_up(now, now - last);
    measured.series.push_back(second);
    each_second(second, latency);
    last = now;
  }
  const double now = elapsed();
  if (now - last > 0.05) measured.series.push_back(all.sum_up(now, now - last).first);
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
