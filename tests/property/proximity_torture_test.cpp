// SPDX-License-Identifier: Apache-2.0
// Proximity: the elementary test against the oracle for separations on the torture families, with distances
// of every size and an ulp around the true one; and what the filter before it proves.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/collider.h"
#include "engine/elementary/proximity.h"
#include "engine/narrow_phase/proximity_filter.h"
#include "tests/property/proximity_verdict.h"
#include "tests/support/brute_force.h"
#include "tests/support/near_oracle.h"
#include "tests/support/near_torture.h"
#include "tests/support/torture.h"

namespace warmfront {
namespace {

using testing::FeatureCase;
using testing::near_truth;
using testing::proximity;

// The primitives as they stand at an end of a motion.
FeatureCase standing(const FeatureCase& query, Instant at) {
  FeatureCase still = query;
  for (VertexMotion& vertex : still.vertices)
    (at == Instant::kStart ? vertex.t1 : vertex.t0) = at == Instant::kStart ? vertex.t0 : vertex.t1;
  return still;
}

// The largest coordinate difference between their vertices.
double size_of(const FeatureVertices& features) {
  double size = 0;
  const int of_a = features.kind == ContactKind::kVertexFace ? 1 : 2;
  for (int i = 0; i < of_a; ++i) {
    for (int j = of_a; j < 4; ++j) {
      for (int axis = 0; axis < 3; ++axis)
        size = std::max(size, std::fabs(features.vertex[j]->t0[axis] - features.vertex[i]->t0[axis]));
    }
  }
  return size;
}

// The distance plus what the certified tier may report beyond it.
double with_excess(const FeatureVertices& features, double distance) {
  return std::min(distance + 0x1p-19 * size_of(features) * (1 + 0x1p-20) + 0x1p-1070,
                  std::numeric_limits<double>::max());
}

// A lower bound of the distance, and not far below it.
void expect_bound(const FeatureCase& query, Instant at, double most) {
  const FeatureCase still = standing(query, at);
  const double bound = least_distance(query.features(), at, most);
  EXPECT_TRUE(bound >= 0 && bound <= most) << bound;
  if (bound > 0) {
    EXPECT_FALSE(near_truth(still.features(), std::nextafter(bound, 0.0)).contact) << bound;
  }
  const double above = bound + 0x1p-19 * size_of(still.features()) + 0x1p-1070;
  if (bound < most && above < std::numeric_limits<double>::max()) {
    EXPECT_TRUE(near_truth(still.features(), above).contact) << bound;
  }
}

// What the filter proves, in any lane.
Nearness filtered(const FeatureCase& query, Instant at, double distance) {
  const std::vector<FeaturePair> pairs(5, {{0, 1, 2, 3}, 0, 0, query.kind});
  const std::vector<double> separations(pairs.size(), distance);
  std::array<Nearness, 5> found;
  proximity_filter(pairs, query.vertices, at, separations, found.data());
  for (const Nearness& lane : found) EXPECT_EQ(lane, found[0]);
  return found[0];
}

// What is proved is true.
void expect_proved(const FeatureCase& query, Instant at, double distance, bool near) {
  const Nearness proved = filtered(query, at, distance);
  EXPECT_TRUE(proved == Nearness::kUnproved || (proved == Nearness::kNear) == near);
}

// Returns whether they are near.
bool expect_truth(const FeatureCase& query, Instant at, double distance) {
  const FeatureCase still = standing(query, at);
  const bool near = near_truth(still.features(), distance).contact;
  const double toi = at == Instant::kStart ? 0 : 1;
  expect_proved(query, at, distance, near);

  const Verdict exact = proximity(query.features(), at, Tier::kExact, distance);
  EXPECT_EQ(exact.contact, near);
  const Verdict certified = proximity(query.features(), at, Tier::kCertified, distance);
  for (const Verdict& verdict : {exact, certified}) {
    EXPECT_TRUE(!verdict.contact || verdict.toi == toi);
  }
  EXPECT_TRUE(!exact.contact || exact.status == ContactStatus::kHit);
  if (near) {
    EXPECT_TRUE(certified.contact);
  } else if (certified.contact) {
    EXPECT_EQ(certified.status, ContactStatus::kPossible);
    EXPECT_TRUE(near_truth(still.features(), with_excess(still.features(), distance)).contact);
  }
  return near;
}

TEST(ProximityTorture, EveryFamilyAtEveryDistance) {
  int near = 0;
  int far = 0;
  const auto look = [&](std::string_view name, const FeatureCase& query, double distance) {
    for (const Instant at : {Instant::kStart, Instant::kEnd}) {
      for (const double d : {distance, std::nextafter(distance, 0.0), std::nextafter(distance, 1e308)}) {
        SCOPED_TRACE(std::string(name) + " " + to_text(testing::NearCase{query, d}));
        (expect_truth(query, at, d) ? near : far) += 1;
        expect_bound(query, at, d);
        ASSERT_FALSE(::testing::Test::HasFailure());
      }
    }
  };
  std::mt19937_64 random(2026);
  for (const testing::NearFamily& family : testing::near_families()) {
    for (int trial = 0; trial < 60; ++trial) {
      const auto kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
      const testing::NearCase made = family.make(random, kind);
      ASSERT_NO_FATAL_FAILURE(look(family.name, made.query, made.separation));
    }
  }
  for (const testing::TortureFamily& family : testing::torture_families()) {
    for (int trial = 0; trial < 60; ++trial) {
      const auto kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
      const FeatureCase query = family.make(random, kind);
      const double distance = trial % 10 == 9 ? 0 : testing::any_separation(random, query);
      ASSERT_NO_FATAL_FAILURE(look(family.name, query, distance));
    }
  }
  EXPECT_GT(near, 500);
  EXPECT_GT(far, 500);
}

// Distances within some 2^-56 to 2^-40 of the pair's size of the true one, where what is proved ends.
TEST(ProximityFilter, ProvesNothingWrongWhereItsErrorsMatter) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> digits(-56, -40);
  std::array<int, 3> proved{};
  const auto look = [&](std::string_view name, const FeatureCase& query, double distance) {
    const Instant at = random() % 2 == 0 ? Instant::kStart : Instant::kEnd;
    const FeatureCase still = standing(query, at);
    const double size = size_of(still.features());
    for (int trial = 0; trial < 6; ++trial) {
      const double beside = std::exp2(digits(random)) * size * (trial % 2 == 0 ? 1 : -1);
      const double d = std::clamp(distance + beside, 0.0, std::numeric_limits<double>::max());
      SCOPED_TRACE(std::string(name) + " " + to_text(testing::NearCase{query, d}));
      expect_proved(query, at, d, near_truth(still.features(), d).contact);
      ++proved[static_cast<std::size_t>(filtered(query, at, d))];
      ASSERT_FALSE(::testing::Test::HasFailure());
    }
  };
  for (const testing::NearFamily& family : testing::near_families()) {
    for (int trial = 0; trial < 200; ++trial) {
      const auto kind = trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
      const testing::NearCase made = family.make(random, kind);
      ASSERT_NO_FATAL_FAILURE(look(family.name, made.query, made.separation));
    }
  }
  // Plain pairs, around the least double that is no less than their distance.
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int trial = 0; trial < 1500; ++trial) {
    FeatureCase query(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge,
                      std::array<VertexMotion, 4>{});
    const double scale = std::ldexp(1.0, static_cast<int>(random() % 300) - 150);
    for (VertexMotion& vertex : query.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertex.t0[axis] = vertex.t1[axis] = scale * uniform();
    }
    double below = least_distance(query.features(), Instant::kStart, 10 * scale);
    if (below == 0) continue;
    double above = below + 0x1p-40 * scale;
    for (double middle = 0.5 * (below + above); middle > below && middle < above;
         middle = 0.5 * (below + above))
      (near_truth(query.features(), middle).contact ? above : below) = middle;
    ASSERT_NO_FATAL_FAILURE(look("plain", query, above));
    for (int units = -6; units <= 6; ++units)
      expect_proved(query, Instant::kStart, above + units * 0x1p-53 * scale,
                    above + units * 0x1p-53 * scale >= above);
    ASSERT_FALSE(::testing::Test::HasFailure()) << "plain " << to_text(testing::NearCase{query, above});
  }
  for (const int count : proved) EXPECT_GT(count, 1000);
}

TEST(ProximityFilter, DecidesNearlyAllPlainPairs) {
  std::mt19937_64 random(12);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int unproved = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    FeatureCase query(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge,
                      std::array<VertexMotion, 4>{});
    for (VertexMotion& vertex : query.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertex.t0[axis] = vertex.t1[axis] = uniform();
    }
    unproved += filtered(query, Instant::kEnd, 0.5 + 0.5 * uniform()) == Nearness::kUnproved ? 1 : 0;
  }
  EXPECT_LT(unproved, 20);
}

// So that it changes no answer; where two corners nearly touch, too.
TEST(ProximityFilter, ProvesApartWhatNoTierReports) {
  std::mt19937_64 random(5);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  int apart = 0;
  for (int trial = 0; trial < 40000; ++trial) {
    FeatureCase query(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge,
                      std::array<VertexMotion, 4>{});
    for (VertexMotion& vertex : query.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertex.t0[axis] = vertex.t1[axis] = uniform();
    }
    const double beside = std::ldexp(1.0, -15 - static_cast<int>(random() % 30));
    query.vertices[3] = query.vertices[random() % 2];
    for (int axis = 0; axis < 3; ++axis)
      query.vertices[3].t0[axis] = query.vertices[3].t1[axis] =
          query.vertices[3].t0[axis] + beside * uniform();
    const double distance = trial % 3 == 0 ? 0 : beside * std::abs(uniform());
    if (filtered(query, Instant::kStart, distance) != Nearness::kApart) continue;
    ++apart;
    for (const Tier tier : {Tier::kCertified, Tier::kExact})
      ASSERT_FALSE(proximity(query.features(), Instant::kStart, tier, distance).contact)
          << to_text(testing::NearCase{query, distance});
  }
  EXPECT_GT(apart, 10000);
}

// Where the direction between the closest points is clear, the bound is as good as doubles are.
TEST(ProximityTorture, BoundsOfPlainPairsAreTight) {
  std::mt19937_64 random(7);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int trial = 0; trial < 2000; ++trial) {
    FeatureCase query(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge,
                      std::array<VertexMotion, 4>{});
    for (VertexMotion& vertex : query.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertex.t0[axis] = vertex.t1[axis] = uniform();
    }
    const double bound = least_distance(query.features(), Instant::kStart, 10);
    EXPECT_TRUE(near_truth(query.features(), bound * (1 + 0x1p-30) + 0x1p-42).contact) << trial;
  }
}

}  // namespace
}  // namespace warmfront
