// SPDX-License-Identifier: Apache-2.0
// What a ground costs, as a half-space and as two static triangles: prints medians of milliseconds of a step
// over a waving cloth of some 10,000 vertices, a line for each place of the cloth and tier, in one run and in
// turn, and what each ground adds to a step without one.
//   half_space_bench [STEPS]
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "engine/collider.h"
#include "tests/bench/timing.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

constexpr int kCells = 100;
constexpr std::uint32_t kVertices = (kCells + 1) * (kCells + 1);
enum Ground { kNone, kHalfSpace, kTriangles, kGrounds };

SceneDescription describe(Ground ground) {
  SceneDescription scene;
  scene.vertex_count = kVertices;
  scene.faces = testing::grid(kCells);
  scene.bodies.push_back({"cloth", 0, kVertices});
  if (ground == kNone) return scene;
  Body body{"ground", kVertices, 0, BodyKind::kStatic};
  if (ground == kHalfSpace) {
    body.half_space = HalfSpace{{0, 0, 0}, {0, 0, 1}};
  } else {
    const auto v = static_cast<std::int32_t>(kVertices);
    body.vertex_count = 4;
    scene.vertex_count += 4;
    scene.faces.push_back({v, v + 1, v + 2});
    scene.faces.push_back({v + 1, v + 3, v + 2});
  }
  scene.bodies.push_back(body);
  return scene;
}

// A wave that runs through the cloth, with its middle at a height.
std::vector<double> frame(Ground ground, double height, int step) {
  std::vector<double> x;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const double phase = 0.2 * i + 0.13 * j + 0.1 * step;
      x.insert(x.end(), {0.02 * i + 0.002 * std::cos(phase), 0.02 * j, height + 0.02 * std::sin(phase)});
    }
  }
  if (ground == kTriangles) {
    for (const double corner : {-5.0, 5.0})
      for (const double other : {-5.0, 5.0}) x.insert(x.end(), {corner + 1, other + 1, 0});
  }
  return x;
}

void run(const char* where, double height, Tier tier, int steps) {
  std::array<std::optional<Collider>, kGrounds> colliders;
  std::array<std::vector<double>, kGrounds> ms;
  std::array<std::uint64_t, kGrounds> contacts{};
  const auto workers = std::make_shared<Workers>(1);
  for (int g = 0; g < kGrounds; ++g) {
    const auto ground = static_cast<Ground>(g);
    const std::vector<double> start = frame(ground, height, 0);
    ColliderOptions options{.tier = tier};
    options.bounds = BoundsKind::kKDop18;
    colliders[g].emplace(
        Collider::create(std::make_shared<const Scene>(Scene::create(describe(ground)).value()),
                         std::span<const double>(start), options, workers)
            .value());
  }
  for (int step = 1; step <= steps; ++step) {
    for (int g = 0; g < kGrounds; ++g) {
      const std::vector<double> x = frame(static_cast<Ground>(g), height, step);
      std::vector<double> cold;
      contacts[g] = testing::timed(step < 5 ? cold : ms[g], [&] {
        return colliders[g]->step(std::span<const double>(x)).value().total();
      });
    }
  }
  const double none = testing::median(ms[kNone]);
  const double half_space = testing::median(ms[kHalfSpace]);
  const double triangles = testing::median(ms[kTriangles]);
  std::printf("%-10s %-10s %10llu %10llu %9.3f %9.3f %9.3f %9.2f %9.2f\n", where,
              std::string(to_string(tier)).c_str(), static_cast<unsigned long long>(contacts[kHalfSpace]),
              static_cast<unsigned long long>(contacts[kTriangles]), none, half_space, triangles,
              half_space / none, triangles / none);
}

}  // namespace
}  // namespace warmfront

int main(int argc, char** argv) {
  using namespace warmfront;
  const int steps = argc > 1 ? std::max(6, std::atoi(argv[1])) : 60;
  std::printf("%-10s %-10s %10s %10s %9s %9s %9s %9s %9s\n", "cloth", "tier", "vh", "vf+ee", "none ms",
              "half sp.", "2 tri.", "half/none", "tri/none");
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    run("far above", 10, tier, steps);
    run("above", 0.03, tier, steps);
    run("through", 0.0, tier, steps);
  }
}
