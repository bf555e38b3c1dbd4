// SPDX-License-Identifier: Apache-2.0
// Culls drop only pairs that the tier would not report: pairs at the limit of its reach, which only a plane
// separates and closest points do not, are answered as by testing every pair, in any frame of the collider.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/elementary/certified.h"
#include "engine/elementary/elementary_test.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "engine/narrow_phase/separation_filter.h"
#include "tests/support/brute_force.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::workers;
using Doubles = std::span<const double>;

struct Motions {
  std::vector<double> from;
  std::vector<double> to;
};

// Two triangles in parallel planes, adjacent along one edge each, that rotate together within their planes.
Motions turning_together(std::mt19937_64& random, double apart) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  const double beside = apart * (1 + uniform() / 2);
  const double angle = 1.5 + 0.1 * uniform();
  const double lean = 3 * uniform();
  const double roll = 3 * uniform();
  const std::array<std::array<double, 3>, 6> flat{
      {{0, 0, 0}, {1, 0, 0}, {0.5, -1, 0}, {0, beside, apart}, {1, beside, apart}, {0.5, 1, apart}}};
  Motions motions;
  for (const bool end : {false, true}) {
    for (const auto& [x, y, z] : flat) {
      const double turned = end ? angle : 0;
      const double a = std::cos(turned) * x - std::sin(turned) * y;
      const double b = std::sin(turned) * x + std::cos(turned) * y;
      const double c = std::cos(lean) * a - std::sin(lean) * z;
      const double d = std::sin(lean) * a + std::cos(lean) * z;
      const double e = std::cos(roll) * b - std::sin(roll) * d;
      const double f = std::sin(roll) * b + std::cos(roll) * d;
      auto& to = end ? motions.to : motions.from;
      to.insert(to.end(), {c, e, f});
    }
  }
  return motions;
}

// Created with everything `away`, then moved to the step's begin: a frame far from the data.
std::vector<Contact> stepped(const std::shared_ptr<const Scene>& scene, const Motions& motions,
                             const ColliderOptions& options, double away) {
  std::vector<double> first = motions.from;
  for (double& x : first) x += away;
  Collider collider = Collider::create(scene, Doubles(first), options, workers()).value();
  if (away != 0) {
    EXPECT_TRUE(collider.step(Doubles(motions.from)).ok());
  }
  const StepResult result = collider.step(Doubles(motions.to)).value();
  return {result.contacts.begin(), result.contacts.end()};
}

TEST(Culls, LeaveOutOnlyWhatIsNotReportedInAnyFrame) {
  const auto scene = testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}});
  std::mt19937_64 random(21);
  int reported = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const double tolerance = std::pow(10.0, -7 + static_cast<double>(random() % 5));
    const double share = std::exp2(static_cast<double>(random() % 120) / 10 - 6);
    const Motions motions = turning_together(random, share * certified_reach(tolerance));
    const std::vector<Contact> expected =
        testing::brute_force(*scene, motions.from, motions.to, {.tolerance = tolerance});
    reported += !expected.empty();
    for (const bool bodies : {false, true}) {
      const ColliderOptions options{.tolerance = tolerance, .find_bodies = bodies};
      for (const double away : {0.0, 1e3, 1e9})
        EXPECT_EQ(stepped(scene, motions, options, away), expected) << trial << ", " << away;
    }
  }
  EXPECT_GT(reported, 20);
  EXPECT_LT(reported, 150);
}

// Thin triangles, nearly in one plane, that cross it at about the same time: the fast tier's roots there are
// rounding errors.
Motions thin_and_flat(std::mt19937_64& random) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  const auto tiny = [&] { return std::ldexp(1.0, -static_cast<int>(random() % 50)); };
  const double thin = tiny();
  const double flat = tiny();
  const double pace = tiny();
  const double lean = 3 * uniform();
  Motions motions;
  for (int k = 0; k < 6; ++k) {
    const double x = uniform();
    const double y = thin * uniform();
    const double z = flat * uniform();
    for (const bool end : {false, true}) {
      const double a = end ? x + pace * uniform() : x;
      const double b = end ? y + thin * pace * uniform() : y;
      const double c = end ? -z : z;
      auto& to = end ? motions.to : motions.from;
      to.insert(to.end(), {std::cos(lean) * a - std::sin(lean) * b, std::sin(lean) * a + std::cos(lean) * b,
                           c + 0.25 * a});
    }
  }
  return motions;
}

TEST(Culls, ChangeNoAnswerOfTheFastTier) {
  const auto scene = testing::make_scene(6, {{0, 1, 2}, {3, 4, 5}});
  std::mt19937_64 random(22);
  int found = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    const Motions motions = thin_and_flat(random);
    const std::vector<VertexMotion> vertices = testing::motion_between(motions.from, motions.to);
    std::vector<Contact> expected;
    ElementaryCounts counts;
    testing::for_all_feature_pairs(*scene, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
      const FeatureVertices features = testing::features_of(*scene, vertices, kind, a, b);
      const FeaturePair pair{{0, 1, 2, 3}, a, b, kind};
      std::array<VertexMotion, 4> four;
      for (std::size_t k = 0; k < 4; ++k) four[k] = *features.vertex[k];
      std::uint16_t survivor = 0;  // the filters are the tier's own
      if (coplanarity_filter({&pair, 1}, four, {}, &survivor) == 0) return;
      if (separation_filter({&pair, 1}, four, &survivor, 1) == 0) return;
      const Verdict verdict = elementary_test(features, {.tier = Tier::kFast}, counts);
      if (verdict.contact) expected.push_back({kind, verdict.status, a, b, verdict.toi});
    });
    found += !expected.empty();
    for (const double away : {0.0, 1e3})
      EXPECT_EQ(stepped(scene, motions, {.tier = Tier::kFast}, away), expected) << trial << ", " << away;
  }
  EXPECT_GT(found, 300);
}

}  // namespace
}  // namespace warmfront
