// SPDX-License-Identifier: Apache-2.0
// How far a motion may go before a pair comes nearer than a share of its own distance: against the distances
// of all pairs at many times, over random scenes; and pair by pair against the oracle for separations, on the
// torture families.
#include "engine/elementary/keep_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/collider.h"
#include "engine/motion/longest_way.h"
#include "tests/support/brute_force.h"
#include "tests/support/distance.h"
#include "tests/support/draws.h"
#include "tests/support/near_oracle.h"
#include "tests/support/scenes.h"
#include "tests/support/torture.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::Draws;
using Doubles = std::span<const double>;

double size_of(const FeatureVertices& features) {
  const int other = features.kind == ContactKind::kVertexFace ? 1 : 2;
  double size = 0;
  for (int a = 0; a < other; ++a) {
    for (int b = other; b < 4; ++b) {
      for (int axis = 0; axis < 3; ++axis) {
        size = std::max(size, std::fabs(features.vertex[b]->t0[axis] - features.vertex[a]->t0[axis]));
        size = std::max(size, std::fabs(features.vertex[b]->t1[axis] - features.vertex[a]->t1[axis]));
      }
    }
  }
  return size;
}

double distance(const FeatureVertices& features, double t) {
  return static_cast<double>(testing::relative_distance(features, t) * size_of(features));
}

ColliderOptions draw_options(Draws& draws) {
  ColliderOptions options;
  options.tier = draws.below(4) == 0 ? Tier::kExact : Tier::kCertified;
  options.front = static_cast<FrontMode>(draws.below(3));
  options.bounds = static_cast<BoundsKind>(draws.below(3));
  options.leaf_size = 1U << draws.below(7);
  options.find_bodies = draws.below(2) == 0;
  return options;
}

// Nothing comes nearer before the fraction, and what is said to be first is about to.
void expect_fraction(const Scene& scene, std::span<const VertexMotion> vertices, const KeepDistance& keep,
                     const MaxStep& far) {
  const double f = far.fraction;
  testing::for_all_pairs(scene, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const FeatureVertices features = testing::features_of(scene, vertices, kind, a, b);
    const double d = distance(features, 0);
    if (!(d > keep.beyond + 1e-9)) return;  // which may count as overlapping
    const double own = keep.beyond + keep.share * (d - keep.beyond);
    const double rounding = 1e-13 * size_of(features);
    for (int k = 1; k <= 8; ++k)
      ASSERT_GE(distance(features, f * k / 8), own - rounding)
          << (kind == ContactKind::kVertexFace ? "vertex-face " : "edge-edge ") << a << " " << b
          << ", which starts " << d << " apart, at " << k << " eighths of " << f;
  });
  ASSERT_EQ(f < 1, far.first.has_value());
  if (!far.first) return;
  const Contact& first = *far.first;
  const FeatureVertices features = testing::features_of(scene, vertices, first.kind, first.a, first.b);
  const double d = distance(features, 0);
  const double own = keep.beyond + keep.share * (d - keep.beyond);
  ASSERT_LE(distance(features, f), own + 0x1p-8 * (d - own) + 0x1p-18 * size_of(features));
}

TEST(KeepDistance, IsKeptByAllPairsAndNoMore) {
  int cut_short = 0, whole = 0, at_start = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Draws draws(seed);
    std::mt19937_64 random(seed);
    const testing::RandomScene state = testing::random_scene(random);
    Collider collider =
        Collider::create(state.scene, Doubles(state.positions), draw_options(draws), testing::workers())
            .value();
    for (int question = 0; question < 4; ++question) {
      std::vector<double> next = testing::random_motion(random, *state.scene, state.positions);
      const double length = std::array{1.0, 0.1, 0.001}[draws.below(3)];
      for (std::size_t i = 0; i < next.size(); ++i)
        next[i] = state.positions[i] + length * (next[i] - state.positions[i]);
      const KeepDistance keep{std::array{0.5, 0.1, 0.9, 0.99}[draws.below(4)],
                              std::array{0.0, 0.01}[draws.below(2)]};
      const QuestionOptions options{.min_separation = keep.beyond, .keep_distance = keep.share};
      const MaxStep far = collider.max_step(Doubles(next), true, options).value();
      const auto vertices = testing::motion_between(state.positions, next);
      ASSERT_NO_FATAL_FAILURE(expect_fraction(*state.scene, vertices, keep, far));
      (far.fraction == 1 ? whole : cut_short) += 1;
      const MaxStep with_overlaps = collider.max_step(Doubles(next), false, options).value();
      ASSERT_EQ(with_overlaps.overlaps_at_start, far.overlaps_at_start);
      if (far.overlaps_at_start == 0) {
        ASSERT_EQ(with_overlaps.fraction, far.fraction);
      }
      at_start += far.overlaps_at_start > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(cut_short, 200);
  EXPECT_GT(whole, 50);
  EXPECT_GT(at_start, 50);
}

// What a pair answers, and what it must: a separation slightly below its own is met no earlier.
TEST(KeepDistance, IsNeverLateOnTheTortureFamilies) {
  int met = 0, met_later = 0, reported = 0;
  for (const testing::TortureFamily& family : testing::torture_families()) {
    std::mt19937_64 random(2024);
    for (int trial = 0; trial < 40; ++trial) {
      const ContactKind kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
      const testing::FeatureCase query = family.make(random, kind);
      const double size = size_of(query.features());
      if (!(size > 0x1p-900 && size < 0x1p900)) continue;  // distances in doubles would say little
      const double d = distance(query.features(), 0);
      const KeepDistance keep{std::array{0.5, 0.1, 0.9, 0.999}[trial / 2 % 4],
                              std::array{0.0, 0.0, 0.01 * size}[trial % 3]};
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(trial) + " " + to_text(query));
      const Verdict verdict = keep_distance_test(query.features(), keep, {});
      reported += verdict.contact ? 1 : 0;
      for (const double latest : {0.5 * verdict.toi, verdict.toi, std::min(1.0, 1.01 * verdict.toi)}) {
        const Verdict by_then = keep_distance_test(query.features(), keep, {.latest = latest});
        ASSERT_EQ(by_then.contact, verdict.contact && verdict.toi <= latest);
        if (by_then.contact) {
          ASSERT_EQ(by_then.toi, verdict.toi);
        }
      }
      if (verdict.contact && verdict.status != ContactStatus::kBudget) {
        // What culls go by: nothing is reported that stays beyond the widest separation of such motions.
        const auto& v = query.vertices;
        const double way = std::max({way_of(v[0]), way_of(v[1]), way_of(v[2]), way_of(v[3])});
        const double within = keep.widest(way, way) + certified_reach(CertifiedOptions{}.tolerance) * size;
        ASSERT_TRUE(testing::near_truth(query.features(), within).contact);
      }
      const double surely = d * (1 - 1e-12) - 1e-17 * size;
      const double own = d <= keep.beyond
                             ? keep.beyond
                             : std::max(keep.share * surely + (1 - keep.share) * keep.beyond, keep.beyond);
      if (!(own > 0)) continue;
      const testing::ExactTruth truth = testing::near_truth(query.features(), own * (1 - 1e-12));
      if (!truth.contact) continue;
      ++met;
      met_later += truth.toi > 0 ? 1 : 0;
      ASSERT_TRUE(verdict.contact);
      ASSERT_LE(verdict.toi, truth.toi);
    }
  }
  EXPECT_GT(met, 200);
  EXPECT_GT(met_later, 100);
  EXPECT_LT(reported, 40 * 31);
}

}  // namespace
}  // namespace warmfront
