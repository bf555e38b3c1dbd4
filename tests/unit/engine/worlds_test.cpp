// SPDX-License-Identifier: Apache-2.0
// Bodies of different worlds: what they meet, what is told of each world, and that others cost nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using testing::workers;
constexpr double kNever = std::numeric_limits<double>::infinity();

template <class T>
std::vector<T> list(std::span<const T> values) {
  return {values.begin(), values.end()};
}

/// Pairs of triangles, the second of each above the first: one pair in each world.
class Pairs {
 public:
  explicit Pairs(std::span<const std::uint32_t> worlds) {
    for (const std::uint32_t world : worlds) {
      for (int k = 0; k < 2; ++k) {
        const auto first = static_cast<std::int32_t>(description.vertex_count);
        description.faces.push_back({first, first + 1, first + 2});
        Body body{"", description.vertex_count, 3};
        body.world = world;
        description.bodies.push_back(body);
        description.vertex_count += 3;
        const double z = k;
        start.insert(start.end(), {0.25 * k, 0.25 * k, z, 1, 0, z, 0, 1, z});
      }
    }
  }

  /// The second of each pair goes down by this much.
  std::vector<double> lowered(std::span<const double> by) const {
    std::vector<double> end = start;
    for (std::size_t pair = 0; pair < by.size(); ++pair)
      for (std::size_t v = 3; v < 6; ++v) end[3 * (6 * pair + v) + 2] -= by[pair];
    return end;
  }

  Collider collider(const ColliderOptions& options = {}) const {
    auto scene = std::make_shared<const Scene>(Scene::create(description).value());
    return Collider::create(scene, std::span<const double>(start), options, workers()).value();
  }

  SceneDescription description;
  std::vector<double> start;
};

TEST(WorldsTest, NearPairsAndTestsGrowWithTheWorldsAndNoMore) {
  const auto counts_of = [](std::uint32_t worlds) {
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t w = 0; w < worlds; ++w) numbers.push_back(w + 1);
    const Pairs pairs(numbers);
    Collider collider = pairs.collider({.find_rigid = false, .separate_parts = false});
    const std::vector<double> end = pairs.lowered(std::vector<double>(worlds, 2.0));
    const StepResult result = collider.step(std::span<const double>(end)).value();
    EXPECT_GT(result.vf, 0U);
    EXPECT_EQ(result.vf % worlds, 0U);
    return result.statistics.counts;
  };
  const StepCounts few = counts_of(8);
  const StepCounts many = counts_of(512);
  EXPECT_EQ(many.near_parts, 64 * few.near_parts);
  EXPECT_EQ(many.elementary_tests, 64 * few.elementary_tests);
  EXPECT_LT(many.bv_tests, 2 * 64 * few.bv_tests);
  // Of 2 n bodies, n pairs may meet, and each body itself.
  EXPECT_EQ(many.part_pairs_excluded, 1024U * 1025U / 2 - 512 - 1024);
}

TEST(WorldsTest, TheEarliestContactOfEachWorldIsReported) {
  const std::array<std::uint32_t, 4> worlds{5, 0xffffffff, 7, 9};
  const Pairs pairs(worlds);
  Collider collider = pairs.collider();
  const std::array<double, 4> by{2, 4, 0.5, 8};
  const std::vector<double> end = pairs.lowered(by);
  const StepResult told =
      collider.trial(std::span<const double>(end), {.tier = Tier::kExact, .report = Report::kEarliest}).value();
  EXPECT_THAT(list(told.worlds), ElementsAre(5, 7, 9, 0xffffffff));
  EXPECT_THAT(list(told.world_tois), ElementsAre(0.5, kNever, 0.125, 0.25));
  EXPECT_EQ(told.earliest_toi, 0.125);
  std::set<double> tois;
  for (const Contact& contact : told.contacts) tois.insert(contact.toi);
  EXPECT_THAT(tois, ElementsAre(0.125, 0.25, 0.5));
  const MaxStep limit = collider.max_step(std::span<const double>(end), false, {.tier = Tier::kExact}).value();
  EXPECT_NEAR(limit.fraction, 0.125, 1e-12);
  EXPECT_LT(limit.fraction, 0.125) << "there is room for what a commit rounds";
  ASSERT_TRUE(limit.first);
  EXPECT_EQ(limit.first->toi, limit.fraction);
  EXPECT_THAT(limit.worlds, ElementsAre(5, 7, 9, 0xffffffff));
  EXPECT_THAT(limit.world_fractions,
              ElementsAre(DoubleNear(0.5, 1e-12), 1, limit.fraction, DoubleNear(0.25, 1e-12)));
  const StepResult all = collider.step(std::span<const double>(end)).value();
  EXPECT_TRUE(all.worlds.empty());
  EXPECT_GE(all.contacts.size(), told.contacts.size());
}

TEST(WorldsTest, BodiesInNoWorldMeetAll) {
  const std::array<std::uint32_t, 2> worlds{3, 4};
  Pairs pairs(worlds);
  pairs.description.bodies[0].world = 0;  // and so, as they lie in one place, below both
  Collider collider = pairs.collider();
  const std::array<double, 2> by{2, 4};
  const std::vector<double> end = pairs.lowered(by);
  const StepResult told =
      collider.trial(std::span<const double>(end), {.tier = Tier::kExact, .report = Report::kEarliest}).value();
  EXPECT_THAT(list(told.worlds), ElementsAre(0, 3, 4));
  // The triangle below the second pair lies in that of world 0 from the start.
  EXPECT_THAT(list(told.world_tois), ElementsAre(kNever, 0.5, 0));
}

TEST(WorldsTest, ABodyMayMoveToAnother) {
  const std::array<std::uint32_t, 2> worlds{1, 1};
  Pairs pairs(worlds);
  pairs.description.bodies.resize(2);
  pairs.description.faces.resize(2);
  pairs.description.vertex_count = 6;
  pairs.start.resize(18);
  Collider collider = pairs.collider();
  const std::array<double, 1> down{2};
  const std::vector<double> below = pairs.lowered(down);
  const auto meets = [&](const std::vector<double>& to) {
    return collider.step(std::span<const double>(to)).value().total() > 0;
  };
  EXPECT_TRUE(meets(below));
  Body body = pairs.description.bodies[1];
  body.world = 2;
  ASSERT_TRUE(collider.change_body(1, body).ok());
  EXPECT_FALSE(meets(pairs.start));
  ASSERT_TRUE(collider.self_check().ok());
  body.world = 0;
  ASSERT_TRUE(collider.change_body(1, body).ok());
  EXPECT_TRUE(meets(below));
  ASSERT_TRUE(collider.self_check().ok());
  body.kind = BodyKind::kRemoved;
  ASSERT_TRUE(collider.change_body(1, body).ok());
  EXPECT_EQ(world_count(collider.scene().bodies()), 1U);
  EXPECT_FALSE(meets(below));
}

TEST(WorldsTest, AQuestionIsRefusedWhereTheEarliestContactsOfAllWorldsAreTooMany) {
  const std::vector<std::uint32_t> worlds{1, 2, 3, 4, 5, 6, 7, 8};
  const Pairs pairs(worlds);
  Collider collider = pairs.collider({.report = Report::kEarliest});
  const std::vector<double> by(8, 2.0);
  const std::vector<double> end = pairs.lowered(by);
  const std::size_t ties = collider.trial(std::span<const double>(end)).value().contacts.size();
  EXPECT_EQ(ties % 8, 0U);
  EXPECT_TRUE(collider.trial(std::span<const double>(end), {.max_contacts = ties}).ok());
  const auto refused = collider.trial(std::span<const double>(end), {.max_contacts = ties - 1});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
}

}  // namespace
}  // namespace warmfront
