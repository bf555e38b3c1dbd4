// SPDX-License-Identifier: Apache-2.0
// Pairs of which one or both move along screws, against where Chasles' theorem takes their vertices: dense in
// time, between which no pair moves farther than its speed says.
#include "engine/screw.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/elementary/turning.h"
#include "tests/property/turning_case.h"
#include "tests/support/screw_oracle.h"

namespace warmfront {
namespace {

using testing::after;
using testing::drawn_pose;
using testing::Draws;
using testing::kMostAngle;
using testing::Long3;
using testing::Mover;
using testing::TurningCase;

TEST(Screw, LeadsWhereChaslesSaysAndEndsWhereThePosesDo) {
  Draws draws(1);
  for (int repetition = 0; repetition < 20'000; ++repetition) {
    const double angle = std::pow(10, -6 * std::abs(draws.uniform(1))) * kMostAngle;
    const Pose from = drawn_pose(draws, draws.uniform(3), 2);
    const Mover mover(from, after(from, drawn_pose(draws, angle, 2)), true);
    EXPECT_NEAR(static_cast<double>(mover.oracle.angle()), std::sqrt(mover.twist.angle_squared), 1e-14);
    const VertexMotion vertex = mover.motion({draws.uniform(2), draws.uniform(2), draws.uniform(2)});
    EXPECT_EQ(on_arc(vertex, mover.twist, 1), vertex.t1);
    EXPECT_EQ(on_arc(vertex, mover.twist, 0), vertex.t0);
    const double s = std::abs(draws.uniform(1));
    const auto at = on_arc(vertex, mover.twist, s);
    const Long3 truth = mover.at(vertex, s);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(at[k], static_cast<double>(truth[k]), 2e-14);
  }
}

TEST(Screw, ACommittedPoseIsOnIt) {
  Draws draws(2);
  for (int repetition = 0; repetition < 20'000; ++repetition) {
    const Pose from = drawn_pose(draws, draws.uniform(3), 2);
    const Mover mover(from, after(from, drawn_pose(draws, draws.uniform(kMostAngle), 2)), true);
    const std::array<double, 3> x{draws.uniform(2), draws.uniform(2), draws.uniform(2)};
    const double f = std::abs(draws.uniform(1));
    const Pose pose = screw_way(mover.from, mover.to, f, false);
    EXPECT_TRUE(check_pose(pose, "pose").ok());
    const auto at = pose.place(x.data());
    const Long3 truth = mover.at(mover.motion(x), f);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(at[k], static_cast<double>(truth[k]), 2e-14);
    EXPECT_EQ(screw_way(mover.from, mover.to, 1, false), mover.to);
    EXPECT_EQ(screw_way(mover.from, mover.to, 0, false), mover.from);
    EXPECT_EQ(screw_way(mover.from, mover.to, f, true), in_float32(pose));
  }
}

// A chord is as near its arc as the second derivative says.
TEST(Screw, IsWithinTheBendOfItsChords) {
  Draws draws(3);
  for (int repetition = 0; repetition < 20'000; ++repetition) {
    const Pose from = drawn_pose(draws, draws.uniform(3), 1);
    const Mover mover(from, after(from, drawn_pose(draws, draws.uniform(kMostAngle), 1)), true);
    const VertexMotion vertex = mover.motion({draws.uniform(1), draws.uniform(1), draws.uniform(1)});
    const auto bend = mover.twist.bend_at({vertex.t0[0], vertex.t0[1], vertex.t0[2]});
    double farthest = 0;
    for (int k = 1; k < 16; ++k) {
      const Long3 arc = mover.at(vertex, k / 16.0L);
      long double square = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const long double line = vertex.t0[axis] + k / 16.0L * (vertex.t1[axis] - vertex.t0[axis]);
        square += (arc[axis] - line) * (arc[axis] - line);
      }
      farthest = std::max(farthest, static_cast<double>(std::sqrt(square)));
    }
    const double bound = std::hypot(bend[0], bend[1], bend[2]) / 8;
    ASSERT_LE(farthest, bound + 1e-14);
    ASSERT_GE(farthest, 0.6 * bound - 1e-14);  // which half a turn is at least
  }
}

TEST(Screw, NoPairIsMissedOrLateAndNoneReportedFromAfar) {
  int met = 0, apart = 0, invented = 0;
  for (std::uint64_t seed = 0; seed < 30'000; ++seed) {
    TurningCase drawn(seed);
    drawn.measure_speed();
    const CertifiedOptions options{.tolerance = 1e-6, .min_separation = drawn.separation};
    const Verdict verdict = turning_test(drawn.pair(), options);
    const auto first = drawn.first_within(drawn.separation, 0, 1, 1e-5);
    SCOPED_TRACE("seed " + std::to_string(seed));
    if (first) {
      ++met;
      ASSERT_TRUE(verdict.contact);
      ASSERT_LE(verdict.toi, *first);
    } else if (drawn.separation > 0) {
      ++apart;
      invented += verdict.contact;
    }
    if (!verdict.contact || verdict.status == ContactStatus::kBudget) continue;
    const double most = (options.tolerance + 2 * certified_reach(options.tolerance)) * drawn.length();
    ASSERT_LE(drawn.distance(verdict.toi), drawn.separation + most);
    if (verdict.status == ContactStatus::kHit) {
      ASSERT_TRUE(drawn.first_within(drawn.separation + 1e-9, 0, 1, 1e-7));
    }
  }
  EXPECT_GT(met, 1'000);
  EXPECT_GT(apart, 500);
  EXPECT_LT(invented, 50);
}

// Touching: what changes sides of a face within it has met it by then.
TEST(Screw, WhatGoesThroughAFaceHasMetIt) {
  int through = 0;
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    const TurningCase drawn(seed);
    if (drawn.features.kind != ContactKind::kVertexFace) continue;
    const Verdict verdict = turning_test(drawn.pair(), {.tolerance = 1e-6});
    constexpr int kTimes = 500;
    const auto side = [&](int k, bool& within) {
      const auto v = drawn.at(static_cast<long double>(k) / kTimes);
      const auto vec = [&](std::size_t i) { return Vec3{v[i].t0[0], v[i].t0[1], v[i].t0[2]}; };
      const Vec3 n = cross(vec(2) - vec(1), vec(3) - vec(1));
      within = true;
      for (std::size_t e = 1; e <= 3; ++e) {
        const Vec3 a = vec(e);
        const Vec3 b = vec(e == 3 ? 1 : e + 1);
        within &= dot(cross(b - a, vec(0) - a), n) > 0.05 * dot(n, n);
      }
      return dot(n, vec(0) - vec(1)) > 0;
    };
    bool before_within = false;
    bool before = side(0, before_within);
    for (int k = 1; k <= kTimes; ++k) {
      bool within = false;
      const bool now = side(k, within);
      if (now != before && within && before_within) {
        ++through;
        ASSERT_TRUE(verdict.contact) << seed;
        ASSERT_LE(verdict.toi, static_cast<double>(k) / kTimes) << seed;
        break;
      }
      before = now;
      before_within = within;
    }
  }
  EXPECT_GT(through, 100);
}

TEST(Screw, NoPairComesNearerThanItKeeps) {
  int kept = 0, limited = 0;
  for (std::uint64_t seed = 0; seed < 15'000; ++seed) {
    TurningCase drawn(seed);
    drawn.measure_speed();
    const KeepDistance keep{0.2, 0};
    const double own = keep.share * drawn.distance(0);
    const Verdict verdict = turning_keep_distance_test(drawn.pair(), keep, {.tolerance = 1e-6});
    const auto first = drawn.first_within(own * (1 - 1e-6), 0, 1, 1e-5);
    SCOPED_TRACE("seed " + std::to_string(seed));
    if (!first) {
      ++kept;
    } else {
      ++limited;
      ASSERT_TRUE(verdict.contact);
      ASSERT_LE(verdict.toi, *first);
    }
    if (verdict.contact && verdict.toi > 0 && verdict.status != ContactStatus::kBudget) {
      ASSERT_LE(drawn.distance(verdict.toi), own + 0.02 * drawn.distance(0) + 1e-5 * drawn.length());
    }
  }
  EXPECT_GT(kept, 500);
  EXPECT_GT(limited, 500);
}

TEST(Screw, NoVertexIsMissedByAHalfSpace) {
  int met = 0, clear = 0;
  for (std::uint64_t seed = 0; seed < 6'000; ++seed) {
    Draws draws(seed);
    const Pose from = drawn_pose(draws, draws.uniform(3), 0.4);
    const Mover mover(from, after(from, drawn_pose(draws, draws.uniform(kMostAngle), 0.6)), true);
    const VertexMotion vertex = mover.motion({draws.uniform(1), draws.uniform(1), draws.uniform(1)});
    HalfSpaceMotion half_space;
    for (std::size_t k = 0; k < 3; ++k) {
      half_space.normal[0][k] = half_space.normal[1][k] = draws.uniform(1);
      half_space.point[0][k] = draws.uniform(1);
      half_space.point[1][k] = half_space.point[0][k] + (draws.below(2) == 0 ? 0 : draws.uniform(0.5));
    }
    const double separation = draws.below(2) == 0 ? 0 : 0.1;
    ElementaryCounts counts;
    const Verdict verdict =
        turning_half_space_test(vertex, mover.twist, half_space, {.min_separation = separation}, counts);
    const auto height = [&](long double s) {
      const Long3 x = mover.at(vertex, s);
      long double sum = 0;
      long double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const long double p = (1 - s) * half_space.point[0][k] + s * half_space.point[1][k];
        sum += half_space.normal[0][k] * (x[k] - p);
        square += static_cast<long double>(half_space.normal[0][k]) * half_space.normal[0][k];
      }
      return static_cast<double>(sum / std::sqrt(square)) - separation;
    };
    constexpr int kTimes = 1'000;
    int first = kTimes + 1;
    for (int k = kTimes; k >= 0; --k) {
      if (height(static_cast<long double>(k) / kTimes) < -1e-12) first = k;
    }
    SCOPED_TRACE("seed " + std::to_string(seed));
    if (first <= kTimes) {
      ++met;
      ASSERT_TRUE(verdict.contact);
      ASSERT_LE(verdict.toi, static_cast<double>(first) / kTimes);
    }
    if (!verdict.contact) {
      ++clear;
    } else if (verdict.status != ContactStatus::kBudget && verdict.toi > 0) {
      ASSERT_LE(height(verdict.toi), 1e-4);
    }
  }
  EXPECT_GT(met, 1'000);
  EXPECT_GT(clear, 1'000);
}

}  // namespace
}  // namespace warmfront
