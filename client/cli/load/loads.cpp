// SPDX-License-Identifier: Apache-2.0
// Running loads: see loads.h.
#include "client/cli/load/loads.h"

#include <cstdio>
#include <optional>
#include <utility>

#include "client/cli/load/knee.h"
#include "client/cli/load/live.h"
#include "client/cli/load/run.h"

namespace warmfront::client::load {
namespace {

bool holds(const Measured& measured, const Limit& limit) {
  constexpr double kPace = 0.98;
  return judge(limit, measured).kept && measured.kept_pace() >= kPace && measured.tally.error_count() == 0;
}

}  // namespace

Result<const Point*> Loads::run(const Plan& plan, std::span<const Limit> limits) {
  Live live(plan);
  Result<Measured> measured = load::run(
      plan, playback_, expected_,
      [&live](const Second& second, const Histogram& latency) { live.show(second, latency); }, interrupted_);
  if (!measured) return measured.error();
  std::vector<Verdict> verdicts = judge(limits, measured.value());
  report_.points.push_back({std::move(measured).value(), std::move(verdicts)});
  return &report_.points.back();
}

Status Loads::find_knee(Plan plan, const Limit& limit, std::span<const Limit> limits) {
  KneeSearch search(plan.rate);
  for (std::optional<double> rate; !interrupted_ && (rate = search.next());) {
    plan.rate = *rate;
    bool held = false;
    for (int attempt = 0; attempt < 2 && !held && !interrupted_; ++attempt) {
      Result<const Point*> point = run(plan, limits);
      if (!point) return point.error();
      held = holds(point.value()->measured, limit);
      std::fprintf(stderr, "%.6g frames a second: %s\n", *rate,
                   judge(limit, point.value()->measured).text().c_str());
    }
    if (!interrupted_) search.tried(held);
  }
  report_.knee = Knee{limit.text(), search.highest_held(), search.lowest_failed()};
  return {};
}

}  // namespace warmfront::client::load
