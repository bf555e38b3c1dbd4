// SPDX-License-Identifier: Apache-2.0
// What trials and commits take beside steps, over a recorded sequence: a solver that asks for the whole motion
// and for two shorter ones, and commits the last. Prints ratios of medians within one run, and passes no verdict.
//   trial_bench FOLDER [FRAMES [THREADS [SEPARATION]]]   a folder with mesh.ply and frames.pc2; 60 frames, 1
//   thread and no separation unless given
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/real_scene.h"

namespace warmfront::testing {
namespace {

using Clock = std::chrono::steady_clock;

class Times {
 public:
  void add(double ms) { all_.push_back(ms); }
  double median() const {
    std::vector<double> sorted = all_;
    std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
    return sorted[sorted.size() / 2];
  }

 private:
  std::vector<double> all_;
};

// What `work` returns, and the milliseconds that it takes.
template <class Work>
auto timed(double& ms, Work&& work) {
  const auto start = Clock::now();
  auto result = work();
  ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  return result;
}

std::vector<float> part_way_all(const std::vector<float>& from, const std::vector<float>& to, float f) {
  std::vector<float> at(from.size());
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = from[i] + f * (to[i] - from[i]);
  return at;
}

int run(const char* folder, int frames, int threads, double separation) {
  FrameSequence sequence(folder);
  SceneDescription description{static_cast<std::uint32_t>(sequence.mesh().positions.size() / 3),
                               sequence.mesh().faces,
                               {}};
  const auto scene = std::make_shared<const Scene>(Scene::create(std::move(description)).value());
  const auto workers = std::make_shared<Workers>(threads);
  ColliderOptions options;
  options.min_separation = separation;
  std::vector<float> x = sequence.read(0);
  const auto make = [&] {
    return Collider::create(scene, std::span<const float>(x), options, workers).value();
  };
  Collider stepper = make(), earliest_stepper = make(), solver = make(), asker = make();
  Times step, refit, first, further, commit, cycle, earliest, max_step;
  const QuestionOptions only_earliest{.report = Report::kEarliest};
  bool same = true;
  for (int f = 1; f < std::min(frames + 1, sequence.count()); ++f) {
    const std::vector<float> y = sequence.read(f);
    const std::vector<float> y2 = part_way_all(x, y, 0.7F);
    const std::vector<float> y3 = part_way_all(x, y, 0.5F);
    const auto frame = [](const std::vector<float>& to) { return Frame(std::span<const float>(to)); };
    double ms[5];
    const StepResult stepped = timed(ms[0], [&] { return stepper.step(frame(y)).value(); });
    step.add(ms[0]);
    refit.add(stepped.statistics.ms.refit);

    const StepResult tried = timed(ms[0], [&] { return solver.trial(frame(y)).value(); });
    same &= std::ranges::equal(tried.contacts, stepped.contacts);
    timed(ms[1], [&] { return solver.trial(frame(y2)).value(); });
    timed(ms[2], [&] { return solver.trial(frame(y3)).value(); });
    timed(ms[3], [&] { return solver.commit(f % 2 == 0 ? 1 : 0.5, Rounding::kFloat32).value(); });
    first.add(ms[0]);
    further.add(ms[1]);
    further.add(ms[2]);
    commit.add(ms[3]);
    cycle.add(ms[0] + ms[1] + ms[2] + ms[3]);
    solver.step(frame(y)).value();  // to where the sequence is

    timed(ms[4], [&] { return earliest_stepper.step(frame(y), nullptr, {}, only_earliest).value(); });
    earliest.add(ms[4]);
    timed(ms[4], [&] { return asker.max_step(frame(y)).value(); });
    max_step.add(ms[4]);
    asker.commit().value();
    x = y;
  }
  const double one = step.median();
  std::printf("%s, %d threads, separation %g: contacts of trials %s those of steps\n", folder, threads,
              separation, same ? "are" : "ARE NOT");
  std::printf("  a step %.3f ms, of which refit %.3f; memory with trials %.3f of that without\n", one,
              refit.median(),
              static_cast<double>(solver.memory_bytes()) / static_cast<double>(stepper.memory_bytes()));
  std::printf("  first trial %.3f of a step, further trials %.3f, three and a commit %.3f\n",
              first.median() / one, further.median() / one, cycle.median() / one);
  std::printf("  commit %.3f of a refit; max_step %.3f of a step that reports the earliest\n",
              commit.median() / refit.median(), max_step.median() / earliest.median());
  return same ? 0 : 1;
}

}  // namespace
}  // namespace warmfront::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: trial_bench FOLDER [FRAMES [THREADS [SEPARATION]]]\n");
    return 2;
  }
  const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
  return warmfront::testing::run(argv[1], static_cast<int>(number(2, 60)), static_cast<int>(number(3, 1)),
                                 number(4, 0));
}
