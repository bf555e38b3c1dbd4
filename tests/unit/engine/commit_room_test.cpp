// SPDX-License-Identifier: Apache-2.0
// What room max_step() leaves for a commit's roundings, case by case; that nothing passes: part_way_test.cpp.
#include "engine/motion/commit_room.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/part_way.h"
#include "engine/pose.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

Collider collider_of(const SceneDescription& scene, std::span<const double> start, Tier tier) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()), start, {.tier = tier},
                          testing::workers())
      .value();
}

// A vertex above a face goes away, through it, or along with it: that goes on, and through goes nothing.
TEST(CommitRoom, WhatStartsWithinTheRoomMayMoveApart) {
  constexpr double kRoom = 0x1p-22;  // of 1, the largest coordinate of what moves
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}}};
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    for (const double separation : {0.0, 1e-3}) {
      for (const double rooms : {0.5, 1.5, 3.0}) {
        SCOPED_TRACE(::testing::Message() << to_string(tier) << ' ' << separation << ' ' << rooms);
        const std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, separation + rooms * kRoom};
        std::vector<double> through = start, away = start, along = start;
        away[11] = 1;
        through[11] = -1;
        for (std::size_t v = 0; v < 4; ++v) along[3 * v] -= 0.25;
        Collider collider = collider_of(scene, start, tier);
        const auto ask = [&](const std::vector<double>& end, bool leave_out) {
          return collider
              .max_step(std::span<const double>(end), leave_out, {.min_separation = separation}, nullptr,
                        Rounding::kFloat32)
              .value();
        };
        const bool far = rooms > CommitRoom::kNear;
        for (const auto& end : {away, along}) {
          EXPECT_EQ(ask(end, false).fraction, 1);
          EXPECT_EQ(ask(end, false).overlaps_at_start, far ? 0U : 1U);
          EXPECT_EQ(ask(end, true).fraction, 1);
          EXPECT_EQ(ask(end, true).overlaps_at_start, far ? 0U : 1U);
        }
        const MaxStep stopped = ask(through, false);
        EXPECT_EQ(stopped.fraction > 0, far);
        EXPECT_LT(stopped.fraction, 2 * kRoom);
        const MaxStep left_out = ask(through, true);
        EXPECT_EQ(left_out.fraction > 0, far || separation > 0);
        EXPECT_LE(left_out.fraction, start[11]);
        EXPECT_EQ(left_out.overlaps_at_start, far ? 0U : 1U);
      }
    }
  }
}

// A vertex that rests is not rounded: a far one does not count, and one that flies off stops nothing else.
TEST(CommitRoom, TheRoomIsThatOfEachPair) {
  std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1e-4, 0, 0, 1e9};
  std::vector<double> end = start;
  end[11] += 0.5;
  end[14] += 1e9;
  SceneDescription scene{5, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}, {"", 4, 1}}};
  Collider collider = collider_of(scene, start, Tier::kCertified);
  const MaxStep far =
      collider.max_step(std::span<const double>(end), false, {}, nullptr, Rounding::kFloat32).value();
  EXPECT_EQ(far.fraction, 1);
  EXPECT_EQ(far.overlaps_at_start, 0U);
}

// All vertices of what goes from pose to pose are placed anew, also one on the axis, which both ends leave
// where it is.
TEST(CommitRoom, AVertexOnTheAxisOfATurnHasRoom) {
  const std::vector<double> start{3 - 3e-8, 4, -1, 3 - 3e-8, 6, -1, 3 - 3e-8, 5, 1, 3, 5, 0};
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3, BodyKind::kStatic}, {"", 3, 1, BodyKind::kRigid}}};
  BodyPose turned{1, {}};
  turned.pose.matrix = {0, -1, 0, 8, 1, 0, 0, 2, 0, 0, 1, 0};
  ASSERT_EQ(turned.pose.place(start.data() + 9), (std::array<double, 3>{3, 5, 0}));
  Frame frame;
  frame.poses = {&turned, 1};
  for (const bool screw : {false, true}) {
    scene.bodies[1].screw = screw;
    Collider collider = collider_of(scene, start, Tier::kCertified);
    const MaxStep far = collider.max_step(frame, false, {}, nullptr, Rounding::kFloat32).value();
    EXPECT_EQ(far.fraction, 0) << screw;
    EXPECT_EQ(far.overlaps_at_start, 1U) << screw;
  }
}

// What it meets within the widest room is noted for questions about part of the way, points among it.
TEST(CommitRoom, AQuestionAfterItFindsWhatAFreshOneDoes) {
  const std::vector<double> start{1000, 0.01, 0, 1000, 0, 0, 1000, 0, 9, 1001, 0, 9, 1000, 1, 9};
  std::vector<double> end = start, half = start;
  for (std::size_t v = 0; v < 5; ++v) end[3 * v + 1] += v == 0 ? -0.02 : 0.001;
  for (std::size_t i = 0; i < end.size(); ++i) half[i] = part_way(start[i], end[i], 0.75, false);
  const SceneDescription scene{5, {{2, 3, 4}}, {{"", 0, 5}}};
  const auto collider = [&] {
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(start), {.find_rigid = false}, testing::workers())
        .value();
  };
  Collider asked = collider(), fresh = collider();
  ASSERT_EQ(
      asked.max_step(std::span<const double>(end), false, {}, nullptr, Rounding::kFloat32).value().fraction,
      1);
  const QuestionOptions near{.min_separation = 1e-4};
  const StepResult found = asked.trial(std::span<const double>(half), near).value();
  const StepResult expected = fresh.trial(std::span<const double>(half), near).value();
  EXPECT_TRUE(std::ranges::equal(found.contacts, expected.contacts));
  EXPECT_EQ(expected.contacts.size(), 1U);
  EXPECT_TRUE(found.statistics.part_of_trial);
}

// Goes again and again to where everything meets, a share of what max_step() allows, and back.
class Pushed {
 public:
  Pushed(std::mt19937& random, Rounding rounding, double away, bool points)
      : single_(rounding == Rounding::kFloat32), scene_{8, {}, {}} {
    if (!points) scene_.faces = {{0, 1, 2}, {4, 5, 6}};
    scene_.bodies = {{"", 0, 4}, {"", 4, 4}};
    std::uniform_real_distribution<double> some(-1, 1);
    const auto coordinate = [&](double x) { return single_ ? static_cast<float>(away + x) : away + x; };
    for (std::size_t i = 0; i < 24; ++i) {
      const double at = some(random);
      const double gap = i % 3 == 2 ? (i < 12 ? -1.5 : 1.5) : 0;
      start_.push_back(coordinate(at + gap));
      end_.push_back(coordinate(at + 0.2 * some(random) - gap));
    }
  }
  const SceneDescription& scene() const { return scene_; }
  const std::vector<double>& start() const { return start_; }
  const std::vector<double>& end() const { return end_; }

 private:
  bool single_;
  SceneDescription scene_;
  std::vector<double> start_, end_;
};

TEST(CommitRoom, NothingIsLeftWithinASeparation) {
  int stopped = 0;
  for (const Rounding rounding : {Rounding::kFloat32, Rounding::kFloat64}) {
    for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
      for (const bool points : {false, true}) {
        for (const double separation : {0.0, 1e-3, 0.1}) {
          if (points && separation == 0) continue;
          for (const double away : {0.0, 100.0}) {
            std::mt19937 random(97);
            for (int trial = 0; trial < 6; ++trial) {
              SCOPED_TRACE(::testing::Message()
                           << (rounding == Rounding::kFloat32 ? "float32 " : "float64 ") << to_string(tier)
                           << (points ? " points " : " faces ") << separation << ' ' << away << ' ' << trial);
              const Pushed pushed(random, rounding, away, points);
              Collider collider = collider_of(pushed.scene(), pushed.start(), tier);
              const auto ask = [&](const std::vector<double>& end) {
                return collider
                    .max_step(std::span<const double>(end), false, {.min_separation = separation}, nullptr,
                              rounding)
                    .value();
              };
              const auto is_near = [&](double distance) {
                return !collider.proximity(distance, Where::kBase, {.tier = Tier::kExact})
                            .value()
                            .contacts.empty();
              };
              if (is_near(2 * separation)) continue;
              // Twice, as a solver that goes on where it was stopped.
              for (int push = 0; push < 2; ++push) {
                const double fraction = ask(pushed.end()).fraction;
                stopped += fraction < 1 ? 1 : 0;
                ASSERT_TRUE(collider.commit(fraction, rounding).ok());
                ASSERT_FALSE(is_near(separation));
              }
              const MaxStep back = ask(pushed.start());
              ASSERT_EQ(back.fraction, 1);
            }
          }
        }
      }
    }
  }
  EXPECT_GT(stopped, 100);
}

// A face that rests and a vertex, above it by so much.
struct Above {
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3, BodyKind::kStatic}, {"", 3, 1}}};
  std::vector<double> start;

  Above(double size, double height, double thin = 1)
      : start{-size, -size, 0, size, -size, 0, 0, (2 * thin - 1) * size, 0, 0, (0.5 * thin - 1) * size,
              height} {}
  std::vector<double> at(double height) const {
    std::vector<double> there = start;
    there[11] = height;
    return there;
  }
};

// What tests in double can tell goes by the size of a pair, and not by the coordinates of what moves.
TEST(CommitRoom, WhatIsPushedAgainstALargeOrThinFaceStaysOnItsSideAndMayGoBack) {
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    for (const Rounding rounding : {Rounding::kFloat32, Rounding::kFloat64}) {
      for (const bool leave_out : {false, true}) {
        for (const double size : {1e-3, 1.0, 1e3, 1e6}) {
          for (const double thin : {1.0, 1e-4, 1e-8}) {
            const Above above(size, 0.7, thin);
            Collider collider = collider_of(above.scene, above.start, tier);
            const auto ask = [&](double height) {
              return collider
                  .max_step(std::span<const double>(above.at(height)), leave_out, {}, nullptr, rounding)
                  .value();
            };
            const auto now = [&] { return collider.positions()[11]; };
            for (int push = 0; push < 40; ++push) {
              ASSERT_TRUE(ask(push % 2 == 0 ? -1 : -1e-3).fraction < 1);
              ASSERT_TRUE(collider.commit(ask(-1).fraction, rounding).ok());
              ASSERT_GT(now(), 0) << to_string(tier) << ' ' << leave_out << ' ' << size << ' ' << thin;
            }
            for (const double away : {1.0, 1e-3, 1e-6})
              ASSERT_EQ(ask(now() + away).fraction, 1)
                  << leave_out << ' ' << size << ' ' << thin << ' ' << now();
          }
        }
      }
    }
  }
}

// Each motion is less than a commit rounds.
TEST(CommitRoom, NoSeparationIsUsedUpByManySmallMotions) {
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    for (const double far : {1.0, 1000.0}) {
      SceneDescription scene = Above(1, 0).scene;
      const double ulp = far * 0x1p-23, separation = 100 * ulp;
      std::vector<double> at{far - 1, far - 1, far, far + 1, far - 1, far,
                             far,     far + 1, far, far,     far,     far + 2 * separation};
      Collider collider = collider_of(scene, at, tier);
      for (int k = 0; k < 400; ++k) {
        at = collider.positions();
        at[11] = static_cast<float>(at[11] - ulp);
        const MaxStep step = collider
                                 .max_step(std::span<const double>(at), false, {.min_separation = separation},
                                           nullptr, Rounding::kFloat32)
                                 .value();
        ASSERT_TRUE(collider.commit(step.fraction, Rounding::kFloat32).ok());
        ASSERT_GE(collider.positions()[11], far + separation) << k;
      }
    }
  }
}

TEST(CommitRoom, WhatTouchesAtRestHoldsUpNothing) {
  const Above above(1, 0);
  SceneDescription scene = above.scene;
  scene.vertex_count = 5;
  scene.bodies.push_back({"", 4, 1});
  std::vector<double> start = above.start;
  start.insert(start.end(), {5, 5, 5});
  for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
    Collider collider = collider_of(scene, start, tier);
    for (int step = 0; step < 3; ++step) {
      std::vector<double> end = collider.positions();
      end[12] += 1;
      const MaxStep far = collider.max_step(std::span<const double>(end)).value();
      ASSERT_EQ(far.fraction, 1);
      EXPECT_EQ(far.overlaps_at_start, 1U);
      ASSERT_TRUE(collider.commit(1).ok());
    }
    std::vector<double> end = collider.positions();
    end[11] -= 1;
    EXPECT_EQ(collider.max_step(std::span<const double>(end)).value().fraction, 0);
  }
}

}  // namespace
}  // namespace warmfront
