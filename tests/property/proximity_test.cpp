// SPDX-License-Identifier: Apache-2.0
// Proximity: the collider against brute force over all pairs of features, on random scenes, warm and cold,
// whatever front, bounds and threads, between trials and commits that it does not disturb.
#include "engine/elementary/proximity.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "engine/collider.h"
#include "tests/property/proximity_verdict.h"
#include "tests/support/brute_force.h"
#include "tests/support/fewer_cases.h"
#include "tests/support/near_oracle.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::near_truth;
using testing::proximity;

std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

double draw_distance(std::mt19937_64& random) {
  constexpr std::array kDistances{0.0, 0.003, 0.02, 0.1, 0.5};
  return kDistances[random() % kDistances.size()];
}

// All pairs within the distance at the positions, as the tier tells them.
std::vector<Contact> brute_force_near(const Scene& scene, const std::vector<double>& x, Tier tier,
                                      double distance, double toi) {
  const std::vector<VertexMotion> vertices = testing::motion_between(x, x);
  std::vector<Contact> near;
  testing::for_all_pairs(scene, distance > 0, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const FeatureVertices features = testing::features_of(scene, vertices, kind, a, b);
    const Verdict verdict = proximity(features, Instant::kStart, tier, distance);
    if (tier == Tier::kExact) RC_ASSERT(verdict.contact == near_truth(features, distance).contact);
    if (verdict.contact) near.push_back({kind, verdict.status, a, b, toi});
  });
  return near;
}

// By vertex the least of the bounds of all pairs that are reported.
std::vector<double> brute_force_distances(const Scene& scene, const std::vector<double>& x, Tier tier,
                                          double distance) {
  const std::vector<VertexMotion> vertices = testing::motion_between(x, x);
  std::vector<double> least(scene.vertex_count(), distance);
  testing::for_all_pairs(scene, distance > 0, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const FeatureVertices features = testing::features_of(scene, vertices, kind, a, b);
    if (!proximity(features, Instant::kStart, tier, distance).contact) return;
    const double bound = least_distance(features, Instant::kStart, distance);
    for (const std::uint32_t v : scene.vertices_of({kind, ContactStatus::kHit, a, b, 0}))
      least[v] = std::min(least[v], bound);
  });
  return least;
}

ColliderOptions draw_options(std::mt19937_64& random) {
  ColliderOptions options;
  options.tier = static_cast<Tier>(random() % 3);
  options.front = static_cast<FrontMode>(random() % 3);
  options.bounds = static_cast<BoundsKind>(random() % 3);
  options.leaf_size = random() % 2 == 0 ? 64 : 1;
  options.lazy_front = random() % 4 != 0;
  if (options.tier != Tier::kFast && random() % 3 == 0) options.min_separation = 0.05;
  return options;
}

Collider make(const testing::RandomScene& made, const std::vector<double>& x,
              const ColliderOptions& options) {
  return Collider::create(made.scene, std::span<const double>(x), options, testing::workers()).value();
}

std::vector<Contact> list(const Result<StepResult>& result) {
  if (!result) RC_FAIL(result.error().message);
  return {result.value().contacts.begin(), result.value().contacts.end()};
}

WARMFRONT_PROPERTY_OF_FEWER_CASES(Proximity, EqualsBruteForceAndDisturbsNothing) {
  std::mt19937_64 random = draw_random();
  const testing::RandomScene made = testing::random_scene(random);
  const ColliderOptions options = draw_options(random);
  std::vector<double> x = made.positions;
  Collider asked = make(made, x, options);
  Collider beside = make(made, x, options);  // is never asked for proximity
  const auto ask = [&](Where where, const std::vector<double>& at) {
    QuestionOptions question;
    if (random() % 2 == 0) question.tier = random() % 2 == 0 ? Tier::kExact : Tier::kCertified;
    const Tier tier = question.tier.value_or(options.tier) == Tier::kExact ? Tier::kExact : Tier::kCertified;
    const double distance = draw_distance(random);
    const std::vector<Contact> truth =
        brute_force_near(*made.scene, at, tier, distance, where == Where::kBase ? 0 : 1);
    for (int repetition = random() % 2 == 0 ? 1 : 2; repetition > 0; --repetition)
      RC_ASSERT(list(asked.proximity(distance, where, question)) == truth);
    question.report = Report::kCount;
    const StepResult counted = asked.proximity(distance, where, question).value();
    RC_ASSERT(counted.vf + counted.ee == truth.size());
    RC_ASSERT(counted.contacts.empty());
    RC_ASSERT(counted.vertex_distances.empty());
    question.report.reset();
    question.max_contacts = 1;  // no row is kept
    const StepResult distances = asked.vertex_distances(distance, where, question).value();
    RC_ASSERT(std::vector(distances.vertex_distances.begin(), distances.vertex_distances.end()) ==
              brute_force_distances(*made.scene, at, tier, distance));
    RC_ASSERT(distances.vf + distances.ee == truth.size());
    RC_ASSERT(distances.contacts.empty());
  };
  for (int k = 0; k < 4; ++k) {
    if (random() % 2 == 0) ask(Where::kBase, x);
    const std::vector<double> y = testing::random_motion(random, *made.scene, x);
    const std::span<const double> there = y;
    if (random() % 3 == 0) {
      RC_ASSERT(list(asked.step(there)) == list(beside.step(there)));
      x = y;
    } else {
      RC_ASSERT(list(asked.trial(there)) == list(beside.trial(there)));
      if (random() % 2 == 0) ask(Where::kTrialEnd, y);
      if (random() % 2 == 0) ask(Where::kBase, x);
      if (random() % 2 == 0) ask(Where::kTrialEnd, y);
      if (random() % 2 == 0) {
        const double fraction = random() % 2 == 0 ? 1 : 0.375;
        const CommitResult of_asked = asked.commit(fraction).value();
        const CommitResult of_beside = beside.commit(fraction).value();
        RC_ASSERT(of_asked.vf == of_beside.vf);
        RC_ASSERT(of_asked.ee == of_beside.ee);
        RC_ASSERT(of_asked.earliest_toi == of_beside.earliest_toi);
      }
      x = beside.positions();
    }
    RC_ASSERT(asked.positions() == x);
    RC_ASSERT(asked.self_check().ok());
  }
}

TEST(Proximity, RefusesWhatItCannotAnswer) {
  const auto scene = testing::make_scene(4, testing::tetrahedron());
  const std::vector<double> x{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::span<const double> still = x;
  Collider collider = Collider::create(scene, still, {}, testing::workers()).value();
  const auto code = [](const auto& result) {
    return result.ok() ? std::nullopt : std::optional(result.error().code);
  };
  EXPECT_EQ(code(collider.proximity(0.1, Where::kTrialEnd)), ErrorCode::kFailedPrecondition);
  EXPECT_EQ(code(collider.proximity(-1)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(collider.proximity(std::numeric_limits<double>::quiet_NaN())), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(collider.proximity(0.1, Where::kBase, {.report = Report::kEarliest})),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(collider.ask(Frame(still), {QuestionKind::kProximity})), ErrorCode::kInvalidArgument);
  // No proximity makes a trial that could be committed, and no refusal forgets one.
  ASSERT_TRUE(collider.proximity(0.1).ok());
  EXPECT_EQ(code(collider.commit()), ErrorCode::kFailedPrecondition);
  ASSERT_TRUE(collider.trial(still).ok());
  EXPECT_EQ(code(collider.proximity(-1, Where::kTrialEnd)), ErrorCode::kInvalidArgument);
  EXPECT_TRUE(collider.proximity(0.1, Where::kTrialEnd).ok());
  EXPECT_TRUE(collider.commit().ok());
  EXPECT_EQ(code(collider.proximity(0.1, Where::kTrialEnd)), ErrorCode::kFailedPrecondition);
}

}  // namespace
}  // namespace warmfront
