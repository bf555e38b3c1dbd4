// SPDX-License-Identifier: Apache-2.0
// What it costs that bodies move along screws: prints medians of milliseconds of a step over rods that turn
// and drift among each other by poses, along lines and along screws, in one run and in turn, a line for each
// angle a step. The last column: a step along screws against as many steps along lines as turn by as much, by
// no more than 10 degrees each, which see nearly what a screw sees.
//   screw_bench [STEPS [RODS [DEGREES]]]
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>

#include "engine/collider.h"
#include "tests/bench/timing.h"
#include "tests/support/scenes.h"
#include "tests/support/screw_oracle.h"

namespace warmfront {
namespace {

constexpr int kCells = 12;  // along a rod's side, of which there are four

enum Way { kLines, kScrews, kWays };

struct Rods {
  SceneDescription scene;
  std::vector<double> x;
};

// Tubes of square section, open at their ends.
Rods make_rods(int count, bool screws) {
  Rods rods;
  for (int r = 0; r < count; ++r) {
    const auto first = static_cast<std::int32_t>(rods.x.size() / 3);
    for (int i = 0; i <= kCells; ++i) {
      for (int k = 0; k < 4; ++k) {
        rods.x.insert(rods.x.end(), {k == 1 || k == 2 ? 0.02 : -0.02, k >= 2 ? 0.02 : -0.02,
                                     0.3 * (static_cast<double>(i) / kCells - 0.5)});
        if (i == kCells) continue;
        const std::int32_t a = first + 4 * i + k;
        const std::int32_t b = first + 4 * i + (k + 1) % 4;
        rods.scene.faces.push_back({a, b, a + 4});
        rods.scene.faces.push_back({b, b + 4, a + 4});
      }
    }
    Body body{"", static_cast<std::uint32_t>(first), 4 * (kCells + 1), BodyKind::kRigid};
    body.screw = screws;
    rods.scene.bodies.push_back(body);
  }
  rods.scene.vertex_count = static_cast<std::uint32_t>(rods.x.size() / 3);
  return rods;
}

/// Of a step, by Way.
struct Cost {
  std::array<double, kWays> ms{};
  std::array<std::uint64_t, kWays> contacts{};
};

Cost run(double degrees, int steps, int count) {
  const auto side = static_cast<int>(std::ceil(std::cbrt(count)));
  std::array<std::optional<Collider>, kWays> colliders;
  std::array<std::vector<double>, kWays> ms;
  std::array<std::uint64_t, kWays> contacts{};
  const auto workers = std::make_shared<Workers>(1);
  for (int way = 0; way < kWays; ++way) {
    const Rods rods = make_rods(count, way == kScrews);
    ColliderOptions options;
    options.bounds = BoundsKind::kKDop18;
    colliders[way].emplace(Collider::create(std::make_shared<const Scene>(Scene::create(rods.scene).value()),
                                            std::span<const double>(rods.x), options, workers)
                               .value());
  }
  testing::Draws draws(7);
  std::vector<Pose> turn;
  std::vector<BodyPose> poses;
  for (int r = 0; r < count; ++r) {
    turn.push_back(testing::drawn_pose(draws, degrees * std::numbers::pi / 180, 0));
    Pose start = testing::drawn_pose(draws, draws.uniform(3), 0.02);
    for (const int axis : {0, 1, 2}) {
      const int cell = axis == 0 ? r % side : axis == 1 ? r / side % side : r / (side * side);
      start.matrix[static_cast<std::size_t>(4 * axis + 3)] += 0.3 * cell;
    }
    poses.push_back({static_cast<std::uint32_t>(r), start});
  }
  for (auto& collider : colliders) {
    if (const Status placed = collider->place(poses); !placed) std::exit(1);
  }
  for (int step = 1; step <= steps; ++step) {
    for (int r = 0; r < count; ++r) {
      Pose& pose = poses[static_cast<std::size_t>(r)].pose;
      Pose turned = pose;
      for (const std::size_t shift : {3, 7, 11}) turned.matrix[shift] = 0;
      turned = testing::after(turned, turn[static_cast<std::size_t>(r)]);
      for (const std::size_t shift : {3, 7, 11})
        turned.matrix[shift] = pose.matrix[shift] + 0.002 * std::sin(0.3 * step + r);
      pose = turned;
    }
    Frame frame;
    frame.poses = poses;
    for (int way = 0; way < kWays; ++way) {
      std::vector<double> cold;
      contacts[way] = testing::timed(step < 5 ? cold : ms[way],
                                     [&] { return colliders[way]->step(frame).value().total(); });
    }
  }
  return {{testing::median(ms[kLines]), testing::median(ms[kScrews])}, contacts};
}

void print(double degrees, int steps, int rods) {
  const Cost cost = run(degrees, steps, rods);
  const double small_steps = std::ceil(degrees / 10);
  const double small =
      small_steps == 1 ? cost.ms[kLines] : run(degrees / small_steps, steps, rods).ms[kLines];
  std::printf("%8g %10llu %10llu %9.3f %9.3f %9.2f %9.2f\n", degrees,
              static_cast<unsigned long long>(cost.contacts[kLines]),
              static_cast<unsigned long long>(cost.contacts[kScrews]), cost.ms[kLines], cost.ms[kScrews],
              cost.ms[kScrews] / cost.ms[kLines], cost.ms[kScrews] / (small_steps * small));
  std::fflush(stdout);
}

}  // namespace
}  // namespace warmfront

int main(int argc, char** argv) {
  using namespace warmfront;
  const int steps = argc > 1 ? std::max(6, std::atoi(argv[1])) : 40;
  const int rods = argc > 2 ? std::max(1, std::atoi(argv[2])) : 200;
  std::printf("%8s %10s %10s %9s %9s %9s %9s\n", "degrees", "on lines", "on screws", "lines ms", "screws ms",
              "ratio", "to small");
  const double only = argc > 3 ? std::atof(argv[3]) : 0;
  for (const double degrees : {1.0, 5.0, 10.0, 30.0, 90.0, 170.0}) {
    if (only == 0 || degrees == only) print(degrees, steps, rods);
  }
}
