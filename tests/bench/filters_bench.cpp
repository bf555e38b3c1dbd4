// SPDX-License-Identifier: Apache-2.0
// What filters change in a question of proximity within two edge lengths, over a recorded sequence: pairs,
// and milliseconds from cold and after a step, without filters, with 1 to 3 rings, and with what was so near
// in the first frame. Prints medians of one run, and passes no verdict.
//   filters_bench FOLDER [FRAMES [THREADS [LENGTHS]]]   a folder with mesh.ply and frames.pc2; 4 frames from
//   the middle, 1 thread, 2 mean edge lengths unless given
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/bench/timing.h"
#include "tests/support/real_scene.h"

namespace warmfront::testing {
namespace {

double mean_edge(const Scene& scene, const std::vector<float>& x) {
  double sum = 0;
  for (const auto& [a, b] : scene.edges())
    sum += std::hypot(x[3 * a] - x[3 * b], x[3 * a + 1] - x[3 * b + 1], x[3 * a + 2] - x[3 * b + 2]);
  return sum / scene.edge_count();
}

void require(bool done) {
  if (!done) std::abort();
}

int run(const char* folder, int frames, int threads, double lengths) {
  FrameSequence sequence(folder);
  const auto workers = std::make_shared<Workers>(threads);
  SceneDescription description{
      static_cast<std::uint32_t>(sequence.mesh().positions.size() / 3), sequence.mesh().faces, {}};
  const Scene plain = Scene::create(description).value();
  const std::vector<float> rest = sequence.read(0);
  const double distance = lengths * mean_edge(plain, rest);
  const int first = std::max(0, std::min(sequence.count() / 2, sequence.count() - frames - 1));

  std::vector<std::pair<std::string, PairFilters>> all{{"none", {}}};
  for (std::uint32_t n = 1; n <= PairFilters::kMostEdges; ++n)
    all.push_back({"within " + std::to_string(n) + " edges", {.within_edges = n}});
  PairFilters at_rest{.near_at_rest = distance};
  at_rest.rest_at(std::span<const float>(rest));
  all.push_back({"so near at rest", at_rest});

  std::printf("%s: within %g (%g edges), %d frames, %d threads; ms, medians\n", folder, distance, lengths,
              frames, threads);
  std::printf("| %-16s | %9s | %9s | %9s | %9s | %11s | %9s | %9s |\n", "filter", "pairs", "create", "cold",
              "warm", "one by one", "triangles", "MiB");
  for (const auto& [name, filters] : all) {
    description.filters = filters;
    const auto scene = std::make_shared<const Scene>(Scene::create(description).value());
    const auto at = [&](const std::vector<float>& x) {
      return Collider::create(scene, std::span<const float>(x), {}, workers).value();
    };
    std::vector<double> create, cold, warm, pairs;
    StepCounts counts;
    Collider kept = at(sequence.read(first));
    const auto ask = [&](Collider& collider) {
      const Result<StepResult> near = collider.proximity(distance);
      if (near) counts = near.value().statistics.counts;
      if (near) pairs.push_back(static_cast<double>(near.value().vf + near.value().ee));
      return near.ok();
    };
    ask(kept);
    for (int f = first + 1; f <= first + frames; ++f) {
      const std::vector<float> y = sequence.read(f);
      require(kept.step(std::span<const float>(y), nullptr, {}, {.report = Report::kCount}).ok());
      require(timed(warm, [&] { return ask(kept); }));
      Collider fresh = timed(create, [&] { return at(y); });
      require(timed(cold, [&] { return ask(fresh); }));
    }
    std::printf("| %-16s | %9.0f | %9.1f | %9.1f | %9.1f | %11llu | %9llu | %9.1f |\n", name.c_str(),
                median(pairs), median(create), median(cold), median(warm),
                static_cast<unsigned long long>(counts.feature_pairs_filtered),
                static_cast<unsigned long long>(counts.triangle_pairs_filtered),
                static_cast<double>(kept.memory_bytes()) / (1 << 20));
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace warmfront::testing

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: filters_bench FOLDER [FRAMES [THREADS [LENGTHS]]]\n");
    return 3;
  }
  return warmfront::testing::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 4,
                                 argc > 3 ? std::atoi(argv[3]) : 1, argc > 4 ? std::atof(argv[4]) : 2);
}
