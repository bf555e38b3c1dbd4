// SPDX-License-Identifier: Apache-2.0
// How long the engine goes on between two looks at a caller's stop flag, and what memory it takes, over
// scenes that ask for much more than they have triangles: prints a line an operation, and passes no verdict.
//   looks_bench [SECONDS] [NAME]   ends each operation after so many seconds (10); only scenes named like
//   NAME
// Its StopSignal::look() takes the engine's place; one thread, so that all looks are in one sequence.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <thread>

#include "engine/collider.h"
#include "engine/stop.h"
#include "tests/support/hostile_scenes.h"

namespace warmfront {
namespace {

using Clock = std::chrono::steady_clock;

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// Of the operation in hand.
struct Looks {
  std::atomic<bool> flag{false};
  Clock::time_point last;
  double longest_ms = 0;
  long count = 0;
  long longest_at = 0;  // the look that ended the longest time without one

  void begin() {
    flag = false;
    longest_ms = 0;
    count = longest_at = 0;
    last = Clock::now();
  }
  void look() {
    const Clock::time_point now = Clock::now();
    const double ms = ms_between(last, now);
    if (ms > longest_ms) {
      longest_ms = ms;
      longest_at = count;
    }
    last = now;
    ++count;
  }
};
Looks looks;

}  // namespace

void StopSignal::look() const {
  looks.look();
  if (flag_->load()) throw Stopped{};
}

namespace {

void forget_peak() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

// The most that was resident since forget_peak(), in MiB.
double peak_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::atof(line.c_str() + 6) / 1024;
  }
  return 0;
}

std::string text_of(const Status& status) {
  return status ? "done" : status.error().message;
}

void measure(const char* what, double limit_s, const std::function<Status()>& operation) {
  forget_peak();
  looks.begin();
  std::atomic<bool> done{false};
  std::atomic<Clock::time_point> stopped{Clock::time_point{}};
  std::thread stopper([&] {
    const Clock::time_point begin = Clock::now();
    while (!done && ms_between(begin, Clock::now()) < 1e3 * limit_s)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (done) return;
    stopped = Clock::now();
    looks.flag = true;
  });
  const Clock::time_point begin = Clock::now();
  std::string outcome;
  try {
    outcome = text_of(operation());
  } catch (const std::bad_alloc&) {
    outcome = "out of memory";
  }
  const Clock::time_point end = Clock::now();
  looks.look();  // the end is as good as one
  done = true;
  stopper.join();
  const bool was_stopped = stopped.load() != Clock::time_point{};
  std::printf("  %-12s %9.1f ms, longest without a look %8.2f ms (before look %ld of %ld), peak %6.0f MiB",
              what, ms_between(begin, end), looks.longest_ms, looks.longest_at, looks.count - 1, peak_mib());
  if (was_stopped) std::printf(", ended %.2f ms after it was told to", ms_between(stopped.load(), end));
  std::printf(": %s\n", outcome.c_str());
  std::fflush(stdout);
}

void run(const std::string& name, const testing::HostileScene& hostile, ColliderOptions options,
         double limit_s) {
  std::printf("%s, report %s\n", name.c_str(), std::string(to_string(options.report)).c_str());
  const auto workers = std::make_shared<Workers>(1);
  const std::span<const double> positions = hostile.positions;
  std::shared_ptr<const Scene> scene;
  measure("scene", limit_s, [&]() -> Status {
    Result<Scene> made = Scene::create(hostile.description, StopSignal(&looks.flag));
    if (!made) return made.error();
    scene = std::make_shared<const Scene>(std::move(made).value());
    return {};
  });
  if (scene == nullptr) return;
  std::unique_ptr<Collider> collider;
  measure("create", limit_s, [&]() -> Status {
    Result<Collider> made = Collider::create(scene, positions, options, workers, &looks.flag);
    if (!made) return made.error();
    collider = std::make_unique<Collider>(std::move(made).value());
    return {};
  });
  if (collider == nullptr) return;
  const auto step = [&](const char* what, const std::vector<double>& to) {
    measure(what, limit_s, [&]() -> Status {
      const Result<StepResult> result = collider->step(std::span<const double>(to), &looks.flag);
      if (!result) return result.error();
      std::printf("  %llu contacts\n",
                  static_cast<unsigned long long>(result.value().vf + result.value().ee));
      return {};
    });
  };
  std::vector<double> moved = hostile.positions;
  for (double& x : moved) x += 1.0 / 1024;
  step("first step", hostile.positions);
  step("at rest", hostile.positions);
  step("moving", moved);
  step("moving back", hostile.positions);
  measure("self-check", limit_s, [&] { return collider->self_check(&looks.flag); });
  if (!scene->bodies().empty()) {
    Body body = scene->bodies()[0];
    measure("no change", limit_s, [&] { return collider->change_body(0, body, &looks.flag); });
    body.name = "renamed";
    measure("renamed", limit_s, [&] { return collider->change_body(0, body, &looks.flag); });
    body.mask = 3;
    measure("mask", limit_s, [&] { return collider->change_body(0, body, &looks.flag); });
  }
  std::printf("  holds %.1f MiB\n", static_cast<double>(collider->memory_bytes()) / (1 << 20));
}

testing::HostileScene as_bodies(testing::HostileScene scene) {
  scene.description.bodies = {{"all", 0, scene.description.vertex_count}};
  return scene;
}

}  // namespace
}  // namespace warmfront

int main(int count, char** arguments) {
  using namespace warmfront;  // NOLINT: a program of its own
  const double limit_s = count > 1 ? std::atof(arguments[1]) : 10;
  const auto wanted = [&](const char* name) {
    return count <= 2 || std::strstr(name, arguments[2]) != nullptr;
  };
  const auto run_named = [&](const char* name, const testing::HostileScene& scene, Report report) {
    ColliderOptions options;
    options.report = report;
    options.max_contacts = 1000;
    if (wanted(name)) run(name, scene, options, limit_s);
  };
  for (const Report report : {Report::kCount, Report::kAll, Report::kEarliest}) {
    run_named("collapsed grid of 20,000 triangles", testing::collapsed_grid(20'000), report);
    run_named("collapsed strip of 10,000 vertices", testing::collapsed_strip(10'000), report);
  }
  run_named("1,000 rigid triangles in one place", testing::coincident_triangles(1000, BodyKind::kRigid),
            Report::kCount);
  for (const int bodies : {5000, 10'000}) {
    const std::string number = std::to_string(bodies);
    run_named((number + " rigid triangles in one place").c_str(),
              testing::coincident_triangles(bodies, BodyKind::kRigid), Report::kCount);
    run_named((number + " deformable triangles in one place").c_str(),
              testing::coincident_triangles(bodies, BodyKind::kDeformable), Report::kCount);
  }
  run_named("fan of 1,000 triangles", as_bodies(testing::fan(1000)), Report::kCount);
  run_named("fan of 9,990 triangles", as_bodies(testing::fan(9990)), Report::kCount);
  run_named("fan of 100,000 triangles", as_bodies(testing::fan(100'000)), Report::kCount);
  run_named("book of 3,000 triangles", as_bodies(testing::book(3000)), Report::kCount);
  run_named("flat grid of 500,000 triangles", as_bodies(testing::flat_grid(500)), Report::kCount);
  return 0;
}
