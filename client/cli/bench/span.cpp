// SPDX-License-Identifier: Apache-2.0
#include "client/cli/bench/span.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "client/cli/bench/schedule.h"
#include "client/cli/print.h"
#include "engine/collider.h"
#include "engine/workers.h"

namespace warmfront::client {
namespace {

constexpr std::array<std::size_t, 8> kCores{1, 2, 4, 8, 16, 32, 64, 128};
constexpr std::size_t kPlaces = 5;
/// Each step is recorded so often, and each piece is as long as it was at best: else the longest chain would
/// be that of whatever else the machine does.
constexpr std::size_t kTimes = 5;

Result<Collider> begin(const Input& input, const FrameSteps& steps, const ColliderOptions& options,
                       int threads) {
  Result<Scene> scene = Scene::create(input.scene());
  if (!scene) return scene.error();
  return Collider::create(std::make_shared<const Scene>(std::move(scene).value()), steps.end(), options,
                          std::make_shared<Workers>(threads));
}

/// Takes a recording of a computation, after others of it that `events` holds or as the first one: each piece
/// as long as in the shortest. An error where they differ in more.
Status take_shorter(const std::string& what, std::vector<ForkTrace::Event>& events,
                    const std::vector<ForkTrace::Event>& again) {
  if (events.empty()) {
    events = again;
    return {};
  }
  const auto alike = [](const ForkTrace::Event& a, const ForkTrace::Event& b) { return a.kind == b.kind; };
  if (!std::ranges::equal(events, again, alike))
    return Error{ErrorCode::kInternal, what + ": forked otherwise when it was repeated"};
  for (std::size_t i = 0; i < events.size(); ++i)
    events[i].seconds = std::min(events[i].seconds, again[i].seconds);
  return {};
}

/// Sums over some steps, in seconds.
struct Sums {
  std::uint64_t steps = 0;
  double work = 0, span = 0;
  std::array<double, kCores.size()> on_cores{};
  std::map<std::string, double> chain;
  double one_thread = 0, all_threads = 0;  // measured, without recording

  void add(const TaskGraph& graph) {
    ++steps;
    work += graph.work();
    span += graph.span();
    for (std::size_t i = 0; i < kCores.size(); ++i) on_cores[i] += graph.on_cores(kCores[i]);
    for (const TaskGraph::Share& share : graph.longest_chain()) chain[share.place] += share.seconds;
  }
};

std::string format(const std::string& name, const Sums& sums, unsigned cores) {
  const auto ms = [&](double seconds) { return 1e3 * seconds / static_cast<double>(sums.steps); };
  std::string text =
      print("%-14s work %9.3f ms, span %8.3f ms; speed-up on", name.c_str(), ms(sums.work), ms(sums.span));
  for (std::size_t i = 0; i < kCores.size(); ++i)
    text += print(" %zu: %.2f", kCores[i], sums.work / sums.on_cores[i]);
  text += print("; measured on %u: %.2f\n", cores, sums.one_thread / sums.all_threads);
  std::vector<std::pair<double, std::string>> places;
  for (const auto& [place, seconds] : sums.chain) places.emplace_back(seconds, place);
  std::ranges::sort(places, std::greater<>());
  for (std::size_t i = 0; i < std::min(kPlaces, places.size()); ++i)
    text += print("  %8.3f ms %5.1f%%  %s\n", ms(places[i].first), 100 * places[i].first / sums.span,
                  places[i].second.c_str());
  return text;
}

}  // namespace

Result<std::string> measure_span(Input& input, FrameRange range, std::uint32_t substeps,
                                 const ColliderOptions& options) {
  Result<FrameSteps> opened = FrameSteps::open(input, range, substeps);
  if (!opened) return opened.error();
  FrameSteps& steps = opened.value();
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  // Recorded; as the first one, but not; and on all cores.
  std::vector<Collider> recorded;
  ForkTrace trace;
  Sums creating, cold, warm;
  std::vector<ForkTrace::Event> events;
  for (std::size_t k = 0; k < kTimes; ++k) {
    trace.clear();
    std::optional<ForkTrace::Recording> recording(std::in_place, trace);
    Result<Collider> begun = begin(input, steps, options, 1);
    recording.reset();
    if (!begun) return begun.error();
    recorded.push_back(std::move(begun).value());
    if (Status status = take_shorter("creating the collider", events, trace.events()); !status)
      return status.error();
  }
  creating.add(TaskGraph(events));
  const auto timed_begin = [&](int threads, double& sum) {
    const auto start = std::chrono::steady_clock::now();
    Result<Collider> begun = begin(input, steps, options, threads);
    sum += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return begun;
  };
  Result<Collider> alone = timed_begin(1, creating.one_thread);
  if (!alone) return alone.error();
  Result<Collider> together = timed_begin(static_cast<int>(cores), creating.all_threads);
  if (!together) return together.error();
  const auto seconds = [&](Collider& collider) -> Result<double> {
    const auto start = std::chrono::steady_clock::now();
    const Result<StepResult> step = collider.step(steps.end());
    if (!step) return step.error();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  for (std::uint64_t step = 0; step < steps.step_count(); ++step) {
    if (Status status = steps.next(); !status) return status.error();
    Sums& sums = step == 0 ? cold : warm;
    events.clear();
    for (Collider& collider : recorded) {
      trace.clear();
      {
        const ForkTrace::Recording recording(trace);
        if (Result<double> took = seconds(collider); !took) return took.error();
      }
      const std::string what = "step to frame " + std::to_string(steps.number());
      if (Status status = take_shorter(what, events, trace.events()); !status) return status.error();
    }
    sums.add(TaskGraph(events));
    for (const auto& [collider, sum] :
         {std::pair(&alone.value(), &sums.one_thread), std::pair(&together.value(), &sums.all_threads)}) {
      const Result<double> took = seconds(*collider);
      if (!took) return took.error();
      *sum += took.value();
    }
  }
  std::string text = format("creating", creating, cores) + format("first step", cold, cores);
  if (warm.steps > 0)
    text += format(print("%llu warm steps", static_cast<unsigned long long>(warm.steps)), warm, cores);
  return text;
}

}  // namespace warmfront::client
