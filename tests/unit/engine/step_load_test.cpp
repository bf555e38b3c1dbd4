// SPDX-License-Identifier: Apache-2.0
// Which questions take one thread: those that the last one tells to be small.
#include "engine/step/step_load.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

constexpr std::uint64_t kElements = 1000;

TEST(StepLoad, IsKnownOfQuestionsLikeTheLast) {
  const ColliderOptions options{.min_separation = 0.01};
  StepLoad load;
  EXPECT_FALSE(load.is_small(options, kElements)) << "the first may build everything";
  load.took(options, {});
  EXPECT_TRUE(load.is_small(options, kElements));
  EXPECT_FALSE(load.is_small(options, 1'000'000));
  EXPECT_TRUE(load.is_small({.min_separation = 0.005}, kElements));
  EXPECT_FALSE(load.is_small({.min_separation = 0.02}, kElements));
  EXPECT_FALSE(load.is_small({.tier = Tier::kExact, .min_separation = 0.01}, kElements));
  EXPECT_FALSE(load.is_small({.min_separation = 0.01, .report = Report::kCandidates}, kElements));
  EXPECT_FALSE(load.is_small({.min_separation = 0.01, .pair_test = PairTest::kProximity}, kElements));
  load.forget();
  EXPECT_FALSE(load.is_small(options, kElements));
}

TEST(StepLoad, IsWhatTheLastOneDid) {
  const ColliderOptions options;
  StepLoad load;
  load.took(options, {.elementary_tests = 10'000});
  EXPECT_FALSE(load.is_small(options, kElements));
  load.took(options, {.exact_tests = 1'000});
  EXPECT_FALSE(load.is_small(options, kElements)) << "integers of any length";
  load.took(options, {.bv_tests = 5'000, .elementary_tests = 500});
  EXPECT_TRUE(load.is_small(options, kElements));
}

TEST(StepLoad, IsForWorkersOfWhichNoNumberWasAsked) {
  EXPECT_TRUE(Workers().adapts_to_steps());
  EXPECT_TRUE(Workers(2, Workers::Bounds::kProcess).adapts_to_steps());
  EXPECT_FALSE(Workers(2).adapts_to_steps());
}

// Of how many threads the step before this one's answer was accepted.
int threads_of_step(Collider& collider, const Workers& workers, std::span<const double> positions) {
  int threads = 0;
  const auto note = [&](const StepResult&) -> Status {
    threads = workers.threads();
    return {};
  };
  EXPECT_TRUE(collider.step(Frame(positions), nullptr, note).ok());
  return threads;
}

std::vector<double> flat(int side, double height) {
  std::vector<double> x;
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j) x.insert(x.end(), {1.0 * i, 1.0 * j, height});
  return x;
}

TEST(StepLoad, LetsASmallStepTakeOneThread) {
  const auto workers = std::make_shared<Workers>(2, Workers::Bounds::kProcess);
  SceneDescription description;
  std::vector<double> x = flat(3, 0);
  description.vertex_count = static_cast<std::uint32_t>(x.size() / 3);
  description.faces = testing::grid(3);
  description.bodies = {{"", 0, description.vertex_count}};
  const auto scene = std::make_shared<const Scene>(Scene::create(description).value());
  Collider collider = Collider::create(scene, std::span<const double>(x), {}, workers).value();
  EXPECT_EQ(threads_of_step(collider, *workers, x), 2) << "the first cannot be predicted";
  EXPECT_EQ(threads_of_step(collider, *workers, x), 1);
  // A large body, far away.
  const std::vector<double> large = flat(100, 1000);
  const auto count = static_cast<std::uint32_t>(large.size() / 3);
  ASSERT_TRUE(collider.add_body({{"", 0, count}, testing::grid(100)}, std::span<const double>(large)).ok());
  x.insert(x.end(), large.begin(), large.end());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(threads_of_step(collider, *workers, x), 2) << "it is small no more";
  EXPECT_EQ(workers->threads(), 2);
}

// With one thread in some steps and several in others, the answers are those of several.
TEST(StepLoad, ChangesNoAnswer) {
  constexpr int kSide = 20;
  const auto scene = testing::make_scene((kSide + 1) * (kSide + 1), testing::grid(kSide));
  std::mt19937_64 random(4);
  const auto frame = [&](double crumpled) {
    std::vector<double> x;
    for (int i = 0; i <= kSide; ++i)
      for (int j = 0; j <= kSide; ++j) x.insert(x.end(), {1.0 * i, 1.0 * j, 0.0});
    for (double& number : x) number += crumpled * (static_cast<double>(random() >> 11) * 0x1p-53);
    return x;
  };
  const std::vector<double> start = frame(0);
  Collider adapting =
      Collider::create(scene, std::span<const double>(start), {}, std::make_shared<Workers>()).value();
  Collider two =
      Collider::create(scene, std::span<const double>(start), {}, std::make_shared<Workers>(2)).value();
  std::size_t contacts = 0;
  for (const double crumpled : {0.01, 0.02, 3.0, 0.02, 0.01, 2.0, 0.02}) {
    const std::vector<double> next = frame(crumpled);
    const StepResult a = adapting.step(std::span<const double>(next)).value();
    const StepResult b = two.step(std::span<const double>(next)).value();
    ASSERT_TRUE(std::ranges::equal(a.contacts, b.contacts)) << "crumpled by " << crumpled;
    contacts += a.contacts.size();
  }
  EXPECT_GT(contacts, 0U);
}

}  // namespace
}  // namespace warmfront
