// SPDX-License-Identifier: Apache-2.0
// Measuring settings in turn: see bench_run.h.
#include "client/cli/bench/run.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <utility>

#include "engine/collider.h"
#include "engine/contact_hash.h"
#include "engine/workers.h"

namespace warmfront::client {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// An input whose frames are in memory, so that reading them is not measured.
class FramesInMemory final : public Input {
 public:
  static Result<FramesInMemory> read(Input& source, FrameRange range) {
    FramesInMemory input(source, range.last - range.first + 1);
    for (std::uint32_t k = range.first; k <= range.last; ++k) {
      if (Status status = source.read_frame(k, input.frames_.emplace_back()); !status) return status.error();
    }
    return input;
  }

  Status read_frame(std::uint32_t index, PositionBuffer& positions) override {
    positions = frames_[index];
    return {};
  }

 private:
  FramesInMemory(const Input& source, std::uint32_t count) : Input(source.name(), source.scene(), count) {}

  std::vector<PositionBuffer> frames_;
};

/// Milliseconds a frame, and of the whole.
struct RoundTimes {
  double create = 0;
  double cold = 0;
  double call = 0;
  StageTimes stage;
};

void add(StageTimes& sum, const StageTimes& more) {
  sum.total += more.total;
  sum.refit += more.refit;
  sum.front += more.front;
  sum.elementary += more.elementary;
  sum.adjacent += more.adjacent;
}

template <class Value>
Spread spread(const std::vector<RoundTimes>& rounds, Value&& value) {
  std::vector<double> ms;
  for (const RoundTimes& round : rounds) ms.push_back(value(round));
  std::ranges::sort(ms);
  const std::size_t middle = ms.size() / 2;
  return {ms.size() % 2 == 1 ? ms[middle] : (ms[middle - 1] + ms[middle]) / 2, ms.front(), ms.back()};
}

/// One round of one setting. Everything except the times goes to `row`, replacing an earlier round's.
Result<RoundTimes> step_through(const std::shared_ptr<const Scene>& scene, Input& frames,
                                std::uint32_t substeps, const std::shared_ptr<Workers>& workers,
                                BenchRow& row) {
  Result<FrameSteps> opened = FrameSteps::open(frames, {0, frames.frame_count() - 1}, substeps);
  if (!opened) return opened.error();
  FrameSteps& steps = opened.value();
  RoundTimes times;
  auto start = Clock::now();
  Result<Collider> collider = Collider::create(scene, steps.end(), row.setting.options, workers);
  if (!collider) return collider.error();
  times.create = ms_since(start);

  row.counts = {};
  row.frames = row.contacts = row.front_bytes = 0;
  ContactHash hash;
  const std::uint64_t count = steps.step_count();
  for (std::uint64_t k = 1; k <= count; ++k) {
    if (Status status = steps.next(); !status) return status.error();
    start = Clock::now();
    const Result<StepResult> result = collider.value().step(steps.end());
    const double call = ms_since(start);
    if (!result) return result.error();
    const StepResult& step = result.value();
    hash.add_step(*scene, step.contacts);
    row.front_bytes = std::max(row.front_bytes, step.statistics.counts.front_bytes);
    if (k == 1) times.cold = call;
    if (k == 1 && count > 1) continue;
    times.call += call;
    add(times.stage, step.statistics.ms);
    add(row.counts, step.statistics.counts);
    row.contacts += step.total();
    ++row.frames;
  }
  row.hash = hash.hex();
  row.memory_bytes = collider.value().memory_bytes();
  const auto frames_stepped = static_cast<double>(row.frames);
  for (double* ms : {&times.call, &times.stage.total, &times.stage.refit, &times.stage.front,
                     &times.stage.elementary, &times.stage.adjacent})
    *ms /= frames_stepped;
  return times;
}

void set_spreads(const std::vector<RoundTimes>& rounds, BenchRow& row) {
  row.create = spread(rounds, [](const RoundTimes& r) { return r.create; });
  row.cold = spread(rounds, [](const RoundTimes& r) { return r.cold; });
  row.frame.call = spread(rounds, [](const RoundTimes& r) { return r.call; });
  const auto of = [&](double StageTimes::*stage) {
    return spread(rounds, [&](const RoundTimes& r) { return r.stage.*stage; });
  };
  row.frame.total = of(&StageTimes::total);
  row.frame.refit = of(&StageTimes::refit);
  row.frame.front = of(&StageTimes::front);
  row.frame.elementary = of(&StageTimes::elementary);
  row.frame.adjacent = of(&StageTimes::adjacent);
}

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

Result<BenchReport> measure_bench(
    const std::string& name, Input& input, FrameRange range, std::uint32_t substeps,
    std::span<const BenchSetting> settings, std::uint32_t rounds,
    const std::function<void(std::uint64_t done, std::uint64_t total)>& progress) {
  Result<FramesInMemory> frames = FramesInMemory::read(input, range);
  if (!frames) return frames.error();
  Result<Scene> created = Scene::create(input.scene());
  if (!created) return created.error();
  const auto scene = std::make_shared<const Scene>(std::move(created).value());
  std::map<int, std::shared_ptr<Workers>> workers;
  BenchReport report;
  report.input = name;
  report.triangles = scene->face_count();
  report.vertices = scene->vertex_count();
  report.steps = std::uint64_t{range.last - range.first} * substeps;
  report.substeps = substeps;
  for (const BenchSetting& setting : settings) {
    report.rows.emplace_back().setting = setting;
    auto& own = workers[setting.threads];
    if (!own) own = std::make_shared<Workers>(setting.threads);
  }
  std::vector<std::vector<RoundTimes>> times(settings.size());
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < settings.size(); ++k) {
      // Alternating order, so that a machine that slows down or warms up favours no setting.
      const std::size_t i = round % 2 == 0 ? k : settings.size() - 1 - k;
      BenchRow& row = report.rows[i];
      const std::string before = row.hash;
      const Result<RoundTimes> one =
          step_through(scene, frames.value(), substeps, workers[settings[i].threads], row);
      if (!one) return one.error();
      times[i].push_back(one.value());
      if (!before.empty() && row.hash != before)
        report.disagreement = "\"" + row.setting.name + "\" gives " + before + " and then " + row.hash;
      progress(round * settings.size() + k + 1, rounds * settings.size());
    }
  }
  for (std::size_t i = 0; i < settings.size(); ++i) set_spreads(times[i], report.rows[i]);
  if (!report.disagreement) report.disagreement = disagreement(report.rows);
  report.peak_rss_bytes = peak_rss_bytes();
  return report;
}

}  // namespace warmfront::client
