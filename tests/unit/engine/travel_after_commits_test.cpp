// SPDX-License-Identifier: Apache-2.0
// What a front keeps, after commits of none, all or a part of a motion that is long beside the scene, or far
// from the origin: the next answer is that of a collider that has kept nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/pose.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;
using Positions = std::vector<double>;

class Draws {
 public:
  explicit Draws(unsigned seed) : random_(seed) {}
  double within(double most) { return std::uniform_real_distribution<double>(-most, most)(random_); }
  bool one_in(unsigned n) { return below(n) == 0; }
  std::size_t below(std::size_t n) { return random_() % n; }
  Positions positions(std::size_t numbers, double size, double at = 0) {
    Positions x(numbers);
    for (double& c : x) c = at + within(size);
    return x;
  }

 private:
  std::mt19937 random_;
};

/// By a seed: everything that does not change an answer.
ColliderOptions options_of(unsigned seed) {
  ColliderOptions options{.tier = Tier::kExact, .bounds = static_cast<BoundsKind>(seed % 3)};
  options.leaf_size = seed % 2 == 0 ? 64 : 1;
  options.separate_parts = seed % 4 < 2;
  options.find_bodies = seed % 8 < 4;
  return options;
}

Collider collider_of(const SceneDescription& scene, const Positions& at, const ColliderOptions& options) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()), Doubles(at), options,
                          testing::workers())
      .value();
}

/// One that keeps nothing.
Collider fresh_collider_of(const SceneDescription& scene, const Positions& at) {
  return collider_of(scene, at, {.tier = Tier::kExact, .front = FrontMode::kNone, .find_rigid = false});
}

/// Does it find what one finds that was made where it is?
::testing::AssertionResult finds_all(Collider& collider, const SceneDescription& scene, const Positions& to,
                                     std::size_t& found, bool step = false) {
  const Positions at = collider.positions();
  const StepResult got = (step ? collider.step(Doubles(to)) : collider.trial(Doubles(to))).value();
  Collider fresh = fresh_collider_of(scene, at);
  const StepResult expected = fresh.trial(Doubles(to)).value();
  found += expected.contacts.size();
  if (std::ranges::equal(got.contacts, expected.contacts)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << got.contacts.size() << " contacts, " << expected.contacts.size() << " are right";
}

SceneDescription triangles(std::uint32_t count) {
  SceneDescription scene{3 * count, {}, {}};
  for (std::uint32_t b = 0; b < count; ++b) {
    const auto v = static_cast<std::int32_t>(3 * b);
    scene.faces.push_back({v, v + 1, v + 2});
    scene.bodies.push_back({"", 3 * b, 3});
  }
  return scene;
}

// Two triangles that have grown to many times what they were made with are asked about twice, and stay. Both
// nodes of a pair had wandered by more than their budget's numbers hold: 655 of 2,000 answers were wrong.
TEST(TravelAfterCommits, LongTrialsThatAreNotTaken) {
  const SceneDescription scene = triangles(2);
  std::size_t found = 0;
  for (const double size : {3.0, 10.0, 30.0, 100.0}) {
    for (unsigned seed = 0; seed < 60; ++seed) {
      for (int how = 0; how < 4; ++how) {
        Draws draw(seed);
        const Positions start = draw.positions(18, 1), grown = draw.positions(18, size);
        Positions nearby = grown;
        nearby[0] += 1;
        Collider collider = collider_of(scene, start, options_of(seed));
        ASSERT_TRUE(collider.step(Doubles(grown)).ok());
        ASSERT_TRUE(collider.trial(Doubles(nearby)).ok());
        const Positions away = draw.positions(18, size);
        const bool asks = how == 3;
        ASSERT_TRUE(asks ? collider.max_step(Doubles(away)).ok() : collider.trial(Doubles(away)).ok());
        if (how == 1) {
          Body renamed = collider.scene().bodies()[1];
          renamed.name = "renamed";
          ASSERT_TRUE(collider.change_body(1, renamed).ok());
        } else if (how != 2) {
          ASSERT_TRUE(collider.commit(0).ok());
        }
        ASSERT_TRUE(finds_all(collider, scene, draw.positions(18, size), found, true))
            << size << ' ' << seed << ' ' << how;
      }
    }
  }
  EXPECT_GT(found, 1000U);
}

// Where a scene has gone millions of its sizes, no comparison of travels says anything.
TEST(TravelAfterCommits, WhereTheSceneIsFarFromWhereItWasMade) {
  std::size_t found = 0;
  for (const double far : {3e6, 1e8}) {
    for (unsigned seed = 0; seed < 400; ++seed) {
      Draws draw(seed);
      const SceneDescription scene = triangles(2 + seed % 3);
      const std::size_t numbers = std::size_t{3} * scene.vertex_count;
      Collider collider = collider_of(scene, draw.positions(numbers, 1), options_of(seed));
      ASSERT_TRUE(collider.step(Doubles(draw.positions(numbers, 1, far))).ok());
      bool asked = false;
      for (int k = 0; k < 12; ++k) {
        if (asked && draw.one_in(4)) {
          const double fraction = draw.one_in(3) ? 0 : draw.one_in(3) ? 1 : std::abs(draw.within(1));
          ASSERT_TRUE(collider.commit(fraction).ok());
          asked = false;
          continue;
        }
        Positions to = draw.positions(numbers, 1, far);
        if (draw.one_in(3)) {
          to = collider.positions();
          for (double& c : to) c += draw.within(0.05);
        } else if (draw.one_in(3)) {
          to = collider.positions();
          for (int moved = 0; moved < 3; ++moved) to[draw.below(numbers)] += draw.within(1);
        }
        const bool step = draw.one_in(6);
        ASSERT_TRUE(finds_all(collider, scene, to, found, step)) << far << ' ' << seed << ' ' << k;
        asked = !step;
      }
    }
  }
  EXPECT_GT(found, 1000U);
}

// Two grids, one after the other.
SceneDescription two_layers(int side) {
  const auto of_one = (side + 1) * (side + 1);
  SceneDescription scene{2 * static_cast<std::uint32_t>(of_one), testing::grid(side), {}};
  for (const auto& face : testing::grid(side))
    scene.faces.push_back({face[0] + of_one, face[1] + of_one, face[2] + of_one});
  return scene;
}

// A commit that rounds to float32 puts vertices beside their way by what is much in a scene far from the
// origin.
TEST(TravelAfterCommits, OfFloat32FarFromTheOrigin) {
  constexpr int kSide = 12;
  SceneDescription scene = two_layers(kSide);
  std::size_t found = 0;
  for (const double far : {1e3, 1e5, 1e6}) {
    for (unsigned seed = 0; seed < 60; ++seed) {
      Draws draw(seed);
      const double gap = std::pow(10, -2 - 3 * std::abs(draw.within(1))), little = 0.01 * gap;
      Positions start;
      for (const int layer : {0, 1}) {
        for (int i = 0; i <= kSide; ++i) {
          for (int j = 0; j <= kSide; ++j)
            start.insert(start.end(),
                         {far + 1.0 * i / kSide, far + 1.0 * j / kSide + 0.03 * layer, far + gap * layer});
        }
      }
      Collider collider = collider_of(scene, start, options_of(seed));
      for (int round = 0; round < 4; ++round) {
        Positions to = collider.positions();
        const double down = draw.within(little);
        for (std::size_t i = 0; i < to.size(); ++i) to[i] += draw.within(little) + (i % 3 == 2 ? down : 0);
        ASSERT_TRUE(collider.trial(Doubles(to)).ok());
        ASSERT_TRUE(collider.commit(0.25 + 0.5 * std::abs(draw.within(1)), Rounding::kFloat32).ok());
        to = collider.positions();
        for (double& c : to) c += draw.within(0.1 * little);
        ASSERT_TRUE(finds_all(collider, scene, to, found)) << far << ' ' << seed << ' ' << round;
      }
    }
  }
  EXPECT_GT(found, 1000U);
}

// Two layers, as one body that is found to move rigidly, are rounded towards each other, and rest.
TEST(TravelAfterCommits, OfWhatMovedRigidly) {
  constexpr int kSide = 6;
  constexpr double kFar = 3e6;
  constexpr std::uint32_t kVertices = (kSide + 1) * (kSide + 1);
  SceneDescription scene = two_layers(kSide);
  scene.vertex_count += 3;
  const auto last = static_cast<std::int32_t>(2 * kVertices);
  scene.faces.push_back({last, last + 1, last + 2});
  scene.bodies = {{"", 0, 2 * kVertices}, {"", 2 * kVertices, 3}};
  std::size_t found = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Draws draw(seed);
    const double gap = 0.15 + 0.15 * std::abs(draw.within(1));
    Positions at;
    for (const int layer : {0, 1}) {
      for (int i = 0; i <= kSide; ++i) {
        for (int j = 0; j <= kSide; ++j)
          at.insert(at.end(), {kFar + i, kFar + j + 0.03 * layer, kFar + gap * layer});
      }
    }
    at.insert(at.end(), {kFar - 5, kFar, kFar, kFar - 6, kFar, kFar, kFar - 5, kFar + 1, kFar});
    Collider collider = collider_of(scene, at, options_of(seed));
    const auto shifted = [&](double x, double z) {
      Positions to = collider.positions();
      for (std::size_t v = 0; v < 2 * kVertices; ++v) {
        to[3 * v] += x;
        to[3 * v + 2] += z;
      }
      return to;
    };
    for (int step = 0; step < 24; ++step)
      ASSERT_TRUE(collider.step(Doubles(shifted(draw.within(0.3), 0))).ok());
    ASSERT_TRUE(collider.trial(Doubles(shifted(draw.within(0.3), draw.within(0.3)))).ok());
    ASSERT_TRUE(collider.commit(0.25 + 0.5 * std::abs(draw.within(1)), Rounding::kFloat32).ok());
    Positions to = collider.positions();
    to[6 * kVertices] += 0.1;
    ASSERT_TRUE(finds_all(collider, scene, to, found)) << seed;
  }
  EXPECT_GT(found, 100U);
}

// A pose that differs by less than any vertex notices is rounded, too, and that moves the body.
TEST(TravelAfterCommits, OfAPoseThatMovesNothing) {
  constexpr int kSide = 4;
  constexpr double kFar = 1e5;
  constexpr std::uint32_t kVertices = (kSide + 1) * (kSide + 1);
  SceneDescription scene = two_layers(kSide);
  scene.bodies = {{"", 0, kVertices}, {"", kVertices, kVertices, BodyKind::kRigid}};
  std::size_t found = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Draws draw(seed);
    const double angle = 0.3 + draw.within(0.2), c = std::cos(angle), s = std::sin(angle);
    const double gap = kFar * 0x1p-24 * (0.02 + 0.4 * std::abs(draw.within(1)));
    BodyPose pose{1, {}};
    pose.pose.matrix = {1, 0, 0, 0, 0, c, -s, kFar - (c - s) * kFar, 0, s, c, kFar - (s + c) * kFar};
    Positions start;
    for (const int body : {0, 1}) {
      for (int i = 0; i <= kSide; ++i) {
        for (int j = 0; j <= kSide; ++j) {
          std::array<double, 3> x{kFar + i + 0.3 * body, kFar + j + 0.2 * body, kFar};
          if (body == 0) {
            x = pose.pose.place(x.data());
            x[1] += s * gap;
            x[2] -= c * gap;
          }
          start.insert(start.end(), x.begin(), x.end());
        }
      }
    }
    Collider collider = collider_of(scene, start, options_of(seed));
    ASSERT_TRUE(collider.place(std::span<const BodyPose>(&pose, 1)).ok());
    Frame frame;
    frame.poses = {&pose, 1};
    for (int step = 0; step < 4; ++step) {
      pose.pose.matrix[3] += draw.within(1e-5);
      ASSERT_TRUE(collider.step(frame).ok());
    }
    for (int round = 0; round < 3; ++round) {
      pose = collider.poses().at(0);
      pose.pose.matrix[1] += 1e-300;
      pose.pose.matrix[4] -= 1e-300;
      ASSERT_TRUE(collider.trial(frame).ok());
      ASSERT_TRUE(collider.commit(0.25 + 0.5 * std::abs(draw.within(1)), Rounding::kFloat32).ok());
      Positions to = collider.positions();
      const double y = draw.within(kFar * 1e-8), z = draw.within(kFar * 1e-8);
      for (std::size_t v = 0; v < kVertices; ++v) {
        to[3 * v + 1] += y;
        to[3 * v + 2] += z;
      }
      const BodyPositions first{0, Doubles(to).first(std::size_t{3} * kVertices)};
      Frame other;
      other.bodies = {&first, 1};
      const StepResult got = collider.trial(other).value();
      Positions at_rest = collider.positions();
      std::copy(start.begin() + 3 * kVertices, start.end(), at_rest.begin() + 3 * kVertices);
      const std::vector<BodyPose> poses = collider.poses();
      Collider fresh = fresh_collider_of(scene, at_rest);
      ASSERT_TRUE(fresh.place(std::span<const BodyPose>(poses)).ok());
      const StepResult expected = fresh.trial(other).value();
      found += expected.contacts.size();
      ASSERT_TRUE(std::ranges::equal(got.contacts, expected.contacts)) << seed << ' ' << round;
    }
  }
  EXPECT_GT(found, 100U);
}

}  // namespace
}  // namespace warmfront
