// SPDX-License-Identifier: Apache-2.0
// What questions about a state take, over a recorded sequence: what is near, within shares of the first
// frame's diagonal, and what is tangled; from cold, after whole and tenth steps, and again while nothing
// moved; the first also reduced to closest pairs; and the loop of a solver, who asks for what is near, how
// far it may go, and moves, each beside the others and alone. Prints medians of one run, and passes no
// verdict.
//   state_bench FOLDER [FRAMES [THREADS [SHARE...]]]   a folder with mesh.ply and frames.pc2; 10 frames from
//   the middle, 1 thread, and shares 0.001 and 0.01 unless given
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/bench/timing.h"
#include "tests/support/real_scene.h"

namespace warmfront::testing {
namespace {

double diagonal(const std::vector<float>& x) {
  std::array<float, 3> least{x[0], x[1], x[2]}, greatest = least;
  for (std::size_t i = 0; i < x.size(); ++i) {
    least[i % 3] = std::min(least[i % 3], x[i]);
    greatest[i % 3] = std::max(greatest[i % 3], x[i]);
  }
  return std::hypot(greatest[0] - least[0], greatest[1] - least[1], greatest[2] - least[2]);
}

struct Medians {
  double cold, step, whole, tenth, again, pairs;
};

/// What a solver's loop takes, question by question; without a distance it does not ask for what is near, and
/// without `moves` not how far it may go.
struct Loop {
  double near, far, commit;
};

class Bench {
 public:
  Bench(const char* folder, int frames, int threads)
      : sequence_(folder), frames_(frames), workers_(std::make_shared<Workers>(threads)) {
    SceneDescription description{
        static_cast<std::uint32_t>(sequence_.mesh().positions.size() / 3), sequence_.mesh().faces, {}};
    scene_ = std::make_shared<const Scene>(Scene::create(std::move(description)).value());
    first_ = std::max(0, std::min(sequence_.count() / 2, sequence_.count() - frames_ - 1));
  }

  double diagonal_of_first() { return diagonal(sequence_.read(0)); }

  // `ask` asks a collider and returns the number of pairs.
  template <class Ask>
  Medians measure(Ask&& ask) {
    std::vector<double> cold, step, whole, tenth, again, pairs;
    std::vector<float> x = sequence_.read(first_);
    Collider warm = at(x);
    ask(warm);
    for (int f = first_ + 1; f <= first_ + frames_; ++f) {
      const std::vector<float> y = sequence_.read(f);
      std::vector<float> near = x;
      for (std::size_t i = 0; i < x.size(); ++i) near[i] += 0.1F * (y[i] - x[i]);
      const auto go = [&](const std::vector<float>& to) {
        timed(step, [&] {
          return warm.step(Frame(std::span<const float>(to)), nullptr, {}, {.report = Report::kCount}).ok();
        });
      };
      go(near);
      timed(tenth, [&] { return ask(warm); });
      go(y);
      pairs.push_back(static_cast<double>(timed(whole, [&] { return ask(warm); })));
      timed(again, [&] { return ask(warm); });
      Collider fresh = at(y);
      timed(cold, [&] { return ask(fresh); });
      x = y;
    }
    return {median(cold), median(step), median(whole), median(tenth), median(again), median(pairs)};
  }

  Loop loop(std::optional<double> distance, bool moves) {
    std::vector<double> near, far, commit;
    const auto asked = [](std::vector<double>& to, auto&& work) {
      if (!timed(to, work)) std::abort();
    };
    Collider warm = at(sequence_.read(first_));
    for (int f = first_ + 1; f <= first_ + frames_; ++f) {
      const std::vector<float> y = sequence_.read(f);
      const Frame to{std::span<const float>(y)};
      asked(near, [&] { return !distance || warm.proximity(*distance, Where::kBase).ok(); });
      if (!moves) {
        asked(commit, [&] { return warm.step(to, nullptr, {}, {.report = Report::kCount}).ok(); });
        continue;
      }
      asked(far, [&] { return warm.max_step(to, true).ok(); });
      asked(commit, [&] { return warm.commit().ok(); });
    }
    if (!moves) far = {0};
    return {median(near), median(far), median(commit)};
  }

 private:
  Collider at(const std::vector<float>& x) const {
    return Collider::create(scene_, std::span<const float>(x), {}, workers_).value();
  }

  FrameSequence sequence_;
  int frames_;
  int first_ = 0;
  std::shared_ptr<Workers> workers_;
  std::shared_ptr<const Scene> scene_;
};

void print(const char* what, const Medians& m) {
  const double a_pair = m.pairs > 0 ? 1e6 / m.pairs : 0;
  std::printf("| %-22s | %9.0f | %9.3f | %9.3f | %9.3f | %9.4f | %6.0f | %6.0f | %8.3f |\n", what, m.pairs,
              m.cold, m.whole, m.tenth, m.again, m.cold * a_pair, m.whole * a_pair, m.step);
}

void print(double share, const Loop& together, const Loop& near, const Loop& far) {
  std::printf("| %-22g | %9.3f | %9.3f | %9.3f | %9.3f | %9.3f |\n", share, near.near, together.near, far.far,
              together.far, together.commit);
}

int run(const char* folder, int frames, int threads, const std::vector<double>& shares) {
  Bench bench(folder, frames, threads);
  std::printf("%s: %d frames, %d threads; ms, medians\n", folder, frames, threads);
  std::printf("| %-22s | %9s | %9s | %9s | %9s | %9s | %6s | %6s | %8s |\n", "question", "pairs", "cold",
              "warm", "tenth", "again", "ns,cold", "ns,warm", "a step");
  for (const double share : shares) {
    const double distance = share * bench.diagonal_of_first();
    char what[32];
    std::snprintf(what, sizeof what, "within %g", share);
    print(what, bench.measure([&](Collider& collider) {
      return collider.proximity(distance).value().contacts.size();
    }));
    std::snprintf(what, sizeof what, "within %g, distances", share);
    const QuestionOptions barrier{
        .fields =
            ContactFields{.weights = true, .direction = true, .squared_distance = true, .closest = true}};
    print(what, bench.measure([&](Collider& collider) {
      return collider.proximity(distance, Where::kBase, barrier).value().contacts.size();
    }));
    std::snprintf(what, sizeof what, "within %g, reduced", share);
    std::vector<double> left;
    print(what, bench.measure([&](Collider& collider) {
      const StepResult reduced = collider.proximity(distance, Where::kBase, {.reduced = true}).value();
      left.push_back(static_cast<double>(reduced.contacts.size()));
      return reduced.vf + reduced.ee;
    }));
    std::printf("reduced to %.0f rows\n", median(left));
  }
  print("tangled",
        bench.measure([](Collider& collider) { return collider.intersections().value().contacts.size(); }));
  std::printf("| %-22s | %9s | %9s | %9s | %9s | %9s |\n", "loop within", "near", "in loop", "max_step",
              "in loop", "commit");
  for (const double share : shares) {
    const double distance = share * bench.diagonal_of_first();
    print(share, bench.loop(distance, true), bench.loop(distance, false), bench.loop({}, true));
  }
  return 0;
}

}  // namespace
}  // namespace warmfront::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: state_bench FOLDER [FRAMES [THREADS [SHARE...]]]\n");
    return 3;
  }
  std::vector<double> shares;
  for (int i = 4; i < argc; ++i) shares.push_back(std::atof(argv[i]));
  if (shares.empty()) shares = {0.001, 0.01};
  return warmfront::testing::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 10,
                                 argc > 3 ? std::atoi(argv[3]) : 1, shares);
}
