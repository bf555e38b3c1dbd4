// SPDX-License-Identifier: Apache-2.0
#include "engine/collider.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cfenv>
#include <cmath>
#include <limits>

#include "engine/contact_hash.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;

using testing::workers;

// Two triangles, one above the other.
struct Two {
  std::shared_ptr<const Scene> scene = testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}});
  std::vector<double> apart{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 1, 1.2, 0.2, 1, 0.2, 1.2, 1};
  std::vector<double> through{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, -1, 1.2, 0.2, -1, 0.2, 1.2, -1};

  Collider collider(const ColliderOptions& options = {}) const {
    return std::move(Collider::create(scene, std::span<const double>(apart), options, workers())).value();
  }
};

TEST(Collider, FindsTheContactsOfTwoTriangles) {
  const Two two;
  Collider collider = two.collider();
  const auto result = collider.step(std::span<const double>(two.through));
  ASSERT_TRUE(result.ok());
  // Vertex 3 through face 0; edges (1,2) of the lower with (3,4) and (3,5) of the upper.
  EXPECT_EQ(result.value().vf, 1U);
  EXPECT_EQ(result.value().ee, 2U);
  EXPECT_NEAR(*result.value().earliest_toi, 0.5, 1e-6);
  ASSERT_EQ(result.value().contacts.size(), 3U);
  EXPECT_EQ(two.scene->vertices_of(result.value().contacts[0]), (std::array<std::uint32_t, 4>{3, 0, 1, 2}));
  EXPECT_EQ(two.scene->vertices_of(result.value().contacts[1]), (std::array<std::uint32_t, 4>{1, 2, 3, 4}));
  EXPECT_EQ(two.scene->vertices_of(result.value().contacts[2]), (std::array<std::uint32_t, 4>{1, 2, 3, 5}));
}

TEST(Collider, FloatAndDoublePositionsAgree) {
  Two two;
  const auto rounded = [](std::vector<double>& x) {
    std::vector<float> narrow(x.begin(), x.end());
    x.assign(narrow.begin(), narrow.end());
    return narrow;
  };
  const auto apart = rounded(two.apart);
  const auto through = rounded(two.through);
  Collider from_double = two.collider();
  Collider from_float =
      std::move(Collider::create(two.scene, std::span<const float>(apart), {}, workers())).value();
  const auto a = from_double.step(std::span<const double>(two.through));
  const auto b = from_float.step(std::span<const float>(through));
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_TRUE(std::ranges::equal(a.value().contacts, b.value().contacts));
}

TEST(Collider, BadPositionsAreNamedAndLeaveItAsItWas) {
  const Two two;
  Collider collider = two.collider();
  auto bad = two.through;
  bad[3 * 4 + 1] = std::numeric_limits<double>::quiet_NaN();
  auto result = collider.step(std::span<const double>(bad));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(result.error().message, HasSubstr("positions[4].y: is not a number"));
  bad[3 * 4 + 1] = -std::numeric_limits<double>::infinity();
  EXPECT_THAT(collider.step(std::span<const double>(bad)).error().message,
              HasSubstr("positions[4].y: is infinite"));
  bad.pop_back();
  EXPECT_THAT(collider.step(std::span<const double>(bad)).error().message,
              HasSubstr("17 values where 18 are expected"));
  EXPECT_TRUE(std::ranges::equal(collider.positions(), two.apart));
  EXPECT_EQ(collider.step(std::span<const double>(two.through)).value().contacts.size(), 3U);
  EXPECT_TRUE(std::ranges::equal(collider.positions(), two.through));
}

TEST(Collider, BadOptionsAreNamed) {
  const Two two;
  const auto error = [&](ColliderOptions options) {
    const auto made = Collider::create(two.scene, std::span<const double>(two.apart), options, workers());
    return made.ok() ? "" : made.error().message;
  };
  EXPECT_EQ(error({}), "");
  EXPECT_THAT(error({.tolerance = 0}), HasSubstr("tolerance"));
  EXPECT_THAT(error({.tolerance = std::numeric_limits<double>::quiet_NaN()}), HasSubstr("tolerance"));
  EXPECT_THAT(error({.min_separation = -1}), HasSubstr("min_separation"));
  EXPECT_THAT(error({.leaf_size = 3}), HasSubstr("leaf_size: 3"));
}

TEST(Collider, TooManyContactsIsAnErrorThatCanBeRecoveredFrom) {
  const Two two;
  Collider limited = two.collider({.max_contacts = 2});
  const auto refused = limited.step(std::span<const double>(two.through));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(refused.error().message, HasSubstr("more than 2 contacts"));
  EXPECT_TRUE(std::ranges::equal(limited.positions(), two.apart));
  // The refused step did not happen: the next one starts where it started.
  auto halfway = two.apart;
  for (int v = 3; v < 6; ++v) halfway[3 * v + 2] = 0.25;
  EXPECT_TRUE(limited.step(std::span<const double>(halfway)).value().contacts.empty());
  EXPECT_TRUE(limited.step(std::span<const double>(two.apart)).value().contacts.empty());
}

TEST(Collider, EmptyAndPointScenes) {
  const auto empty = testing::make_scene(0, {});
  auto nothing = Collider::create(empty, std::span<const double>(), {}, workers());
  ASSERT_TRUE(nothing.ok());
  EXPECT_TRUE(nothing.value().step(std::span<const double>()).value().contacts.empty());
  // An isolated vertex falls through a triangle.
  const auto scene = testing::make_scene(4, {{0, 1, 2}});
  const std::vector<double> above{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1};
  const std::vector<double> below{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, -1};
  for (const auto bounds : {BoundsKind::kAabb, BoundsKind::kKDop18}) {
    auto points = Collider::create(scene, std::span<const double>(above), {.bounds = bounds}, workers());
    const auto result = points.value().step(std::span<const double>(below));
    EXPECT_EQ(result.value().vf, 1U);
    EXPECT_EQ(result.value().statistics.counts.triangle_pairs, 0U);
  }
}

// All faces around a vertex are adjacent to each other: the orphan sets of a fan grow with its square.
TEST(Collider, HubVerticesAreHandledOrRefusedByName) {
  const auto fan = [](int blades) {
    testing::Faces faces;
    for (int i = 0; i < blades; ++i) faces.push_back({7, i < 7 ? i : i + 1, i + 1 < 7 ? i + 1 : i + 2});
    return testing::make_scene(static_cast<std::uint32_t>(blades + 2), faces);
  };
  const auto make = [](const std::shared_ptr<const Scene>& scene) {
    const std::vector<double> positions(3 * scene->vertex_count(), 0.0);
    return Collider::create(scene, std::span<const double>(positions), {}, workers());
  };
  EXPECT_TRUE(make(fan(500)).ok());
  const auto refused = make(fan(20000));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(refused.error().message, HasSubstr("vertex 7 alone is in 20000 faces"));
}

// Two hubs with so many faces that shared vertices are computed instead of looked up; the cones between them
// intersect. Leaves of one triangle look nothing up.
TEST(Collider, ConesOfManyFacesAnswerWhateverTheLeaves) {
  constexpr int kRim = 150;
  testing::Faces faces;
  for (int i = 0; i < kRim; ++i) {
    faces.push_back({0, 2 + i, 2 + (i + 1) % kRim});
    faces.push_back({1, 2 + i, 2 + (i + 1) % kRim});
  }
  const auto scene = testing::make_scene(kRim + 2, faces);
  std::vector<double> start{0, 0, 1, 0, 0, -1};
  for (int i = 0; i < kRim; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kRim;
    start.insert(start.end(), {std::cos(angle), std::sin(angle), 0.1 * std::sin(5 * angle)});
  }
  std::vector<Collider> colliders;
  for (const std::uint32_t leaf_size : {1U, 8U, 64U}) {
    colliders.push_back(
        std::move(Collider::create(scene, std::span<const double>(start), {.leaf_size = leaf_size}, workers())
                      .value()));
  }
  std::size_t contacts = 0;
  for (int step = 1; step <= 12; ++step) {
    std::vector<double> next = start;
    const double turn = 0.4 * step;
    next[2] = std::cos(turn);
    next[3] = 0.2 * std::sin(turn);
    next[5] = -std::cos(turn);
    for (int i = 0; i < kRim; ++i) next[3 * (2 + i) + 2] *= 1 + std::sin(turn + i);
    const auto expected = colliders[0].step(std::span<const double>(next));
    ASSERT_TRUE(expected.ok());
    contacts += expected.value().contacts.size();
    for (std::size_t c = 1; c < colliders.size(); ++c) {
      const auto result = colliders[c].step(std::span<const double>(next));
      ASSERT_TRUE(result.ok());
      EXPECT_TRUE(std::ranges::equal(result.value().contacts, expected.value().contacts)) << step << " " << c;
      EXPECT_EQ(result.value().statistics.counts.triangle_pairs,
                expected.value().statistics.counts.triangle_pairs)
          << step << " " << c;
    }
  }
  EXPECT_GT(contacts, 100U);
}

TEST(Collider, FrontStates) {
  const Two two;
  const auto states = [&](ColliderOptions options) {
    Collider collider = two.collider(options);
    std::vector<FrontState> seen;
    for (int i = 0; i < 5; ++i) {
      seen.push_back(collider.step(std::span<const double>(i % 2 == 0 ? two.through : two.apart))
                         .value()
                         .statistics.front_state);
    }
    return seen;
  };
  using enum FrontState;
  EXPECT_THAT(states({.front = FrontMode::kNone}), ::testing::Each(kNone));
  EXPECT_THAT(states({.front = FrontMode::kWarm}),
              ::testing::ElementsAre(kBuilt, kUpdated, kUpdated, kUpdated, kUpdated));
  EXPECT_THAT(states({.front = FrontMode::kPaper, .rebuild_after_stalled_steps = 2}),
              ::testing::ElementsAre(kBuilt, kUpdated, kUpdated, kRebuilt, kUpdated));
  EXPECT_THAT(
      states({.front = FrontMode::kPaper, .rebuild_after_stalled_steps = 0, .rebuild_every_steps = 2}),
      ::testing::ElementsAre(kBuilt, kUpdated, kRebuilt, kUpdated, kRebuilt));
  EXPECT_THAT(states({.front = FrontMode::kWarm, .max_front_bytes = 8}), ::testing::Each(kCapped));
}

// oneTBB gives tasks the environment in which their arena was made: Workers made in a strange one must not
// pass it on.
TEST(Workers, RunTasksInTheDefaultEnvironmentAndGiveTheCallerItsOwnBack) {
  for (const bool made_strange : {false, true}) {
    if (made_strange) std::fesetround(FE_UPWARD);
    Workers fresh(2);
    std::fesetround(FE_UPWARD);
    std::atomic<int> strange{0};
    fresh.rouse();
    fresh.run([&] {
      tbb::parallel_for(0, 1000, [&](int) { strange += std::fegetround() != FE_TONEAREST; });
      strange += std::fegetround() != FE_TONEAREST;
    });
    EXPECT_EQ(strange.load(), 0);
    EXPECT_EQ(std::fegetround(), FE_UPWARD);
    std::fesetround(FE_TONEAREST);
  }
}

// Found in review: bounds with a margin of each vertex's own let the frame of an older time decide.
TEST(Collider, AnswersDoNotDependOnTheFrameOfCreation) {
  const auto scene = testing::make_scene(5, {{0, 1, 2}});
  const std::vector<double> before{2e-15, 0, 0, 1, 0.5, 0, 1, -0.5, 0, 0, 0, 0, -1, 0, 0};
  std::vector<double> after = before;
  after[12] = -3;
  after[13] = 4;
  after[14] = 5;
  for (const auto bounds : {BoundsKind::kAabb, BoundsKind::kKDop18}) {
    const ColliderOptions options{.bounds = bounds};
    auto warm =
        std::move(Collider::create(scene, std::span<const double>(before), options, workers())).value();
    ASSERT_TRUE(warm.step(std::span<const double>(after)).ok());
    auto cold =
        std::move(Collider::create(scene, std::span<const double>(after), options, workers())).value();
    const auto from_warm = warm.step(std::span<const double>(after));
    const auto from_cold = cold.step(std::span<const double>(after));
    EXPECT_TRUE(std::ranges::equal(from_warm.value().contacts, from_cold.value().contacts));
  }
}

TEST(Collider, TooManyEarliestContactsAreRefusedToo) {
  // Many triangles that all lie in one another from the start: every contact has toi 0.
  testing::Faces faces;
  std::vector<double> positions;
  for (int i = 0; i < 10; ++i) {
    faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    for (const double x : {0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0}) positions.push_back(x);
  }
  const auto scene = testing::make_scene(30, faces);
  for (const auto report : {Report::kAll, Report::kEarliest}) {
    auto limited = std::move(Collider::create(scene, std::span<const double>(positions),
                                              {.report = report, .max_contacts = 20}, workers()))
                       .value();
    const auto refused = limited.step(std::span<const double>(positions));
    ASSERT_FALSE(refused.ok()) << to_string(report);
    EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  }
}

// A refused step must leave no budgets: they would be relative to positions that were never reached.
TEST(Collider, ARefusedStepLeavesNoPromises) {
  testing::Faces faces{{0, 1, 2}, {3, 4, 5}};
  std::vector<double> start{-1,  -1, 0,    1,   -1, 0,   0,   1,   0,   // wide
                            1.5, 0,  -0.5, 1.5, 0,  0.5, 1.7, 0.1, 0};  // beside it
  for (int i = 0; i < 5; ++i) {                                         // a pile, far away
    faces.push_back({6 + 3 * i, 7 + 3 * i, 8 + 3 * i});
    for (const double x : {0.0, 100.0, 1.0 + i, 1.0, 100.0, 1.0 + i, 0.0, 101.0, 1.0 + i}) start.push_back(x);
  }
  const auto scene = testing::make_scene(21, faces);
  std::vector<double> refused = start;
  for (int k = 0; k < 9; ++k) refused[k] *= 0.01;                // the wide one shrinks from its neighbour
  for (int k = 20; k < 63; k += 3) refused[k] = 7 - refused[k];  // the pile turns inside out: many contacts
  std::vector<double> crossing = start;
  for (const int x : {9, 12, 15}) crossing[x] -= 1.3;  // the neighbour comes into the wide one
  for (const std::uint32_t leaf_size : {1U, 8U, 64U}) {
    const ColliderOptions options{.leaf_size = leaf_size, .max_contacts = 4};
    const auto make = [&](ColliderOptions with) {
      return std::move(Collider::create(scene, std::span<const double>(start), with, workers())).value();
    };
    Collider collider = make(options);
    ASSERT_TRUE(collider.step(std::span<const double>(start)).ok());
    ASSERT_FALSE(collider.step(std::span<const double>(refused)).ok());
    Collider fresh = make(options);
    const auto after = collider.step(std::span<const double>(crossing));
    const auto expected = fresh.step(std::span<const double>(crossing));
    ASSERT_TRUE(expected.ok());
    ASSERT_GT(expected.value().contacts.size(), 0U);
    ASSERT_TRUE(after.ok());
    EXPECT_TRUE(std::ranges::equal(after.value().contacts, expected.value().contacts))
        << "leaves of " << leaf_size;
  }
}

}  // namespace
}  // namespace warmfront
