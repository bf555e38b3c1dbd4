// SPDX-License-Identifier: Apache-2.0
// The elementary tests of a vertex and a half-space at the extremes, against the truth: exact touching at the
// start, at the end and in between, grazing, half turns, normals of any length, huge, tiny and denormal
// numbers. WARMFRONT_TORTURE: pairs of each family (2,000).
#include "engine/elementary/half_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include "tests/support/draws.h"
#include "tests/support/half_space_oracle.h"

namespace warmfront {
namespace {

using testing::ExactTruth;
using testing::half_space_truth;

struct Pair {
  VertexMotion vertex{};
  HalfSpaceMotion half_space{};
  double separation = 0;

  /// The largest coordinate of x - p, and the separation.
  double size() const {
    double largest = separation;
    for (std::size_t k = 0; k < 3; ++k) {
      largest = std::max({largest, std::fabs(vertex.t0[k] - half_space.point[0][k]),
                          std::fabs(vertex.t1[k] - half_space.point[1][k])});
    }
    return largest;
  }
  /// As it stands at an instant.
  Pair at(Instant instant) const {
    const std::size_t end = instant == Instant::kStart ? 0 : 1;
    const auto& x = end == 0 ? vertex.t0 : vertex.t1;
    return {
        {x, x},
        {{half_space.point[end], half_space.point[end]}, {half_space.normal[end], half_space.normal[end]}},
        separation};
  }
  Pair within(double other) const { return {vertex, half_space, other}; }
  ExactTruth truth() const { return half_space_truth(vertex, half_space, separation); }
  bool comfortable() const {
    for (std::size_t k = 0; k < 3; ++k) {
      for (const double x : {vertex.t0[k], vertex.t1[k], half_space.point[0][k], half_space.point[1][k],
                             half_space.normal[0][k], half_space.normal[1][k], separation})
        if (x != 0 && !(std::fabs(x) > 0x1p-200 && std::fabs(x) < 0x1p200)) return false;
    }
    return true;
  }
};

std::string to_text(const Pair& pair) {
  std::string text;
  char number[32];
  const auto put = [&](const char* name, const double* x) {
    text += name;
    for (int k = 0; k < 3; ++k) {
      std::snprintf(number, sizeof number, " %a", x[k]);
      text += number;
    }
    text += "\n";
  };
  put("x0", pair.vertex.t0.data());
  put("x1", pair.vertex.t1.data());
  put("p0", pair.half_space.point[0].data());
  put("p1", pair.half_space.point[1].data());
  put("n0", pair.half_space.normal[0].data());
  put("n1", pair.half_space.normal[1].data());
  std::snprintf(number, sizeof number, "s %a", pair.separation);
  return text + number;
}

class Torture : public testing::Draws {
 public:
  using Draws::Draws;

  enum Family : std::uint8_t { kIntegers, kDoubles, kGrazing, kScales, kNearlyTouching, kFamilies };

  Pair draw(Family family) {
    Pair pair;
    const auto fill = [&](auto&& number) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (double* x :
             {&pair.vertex.t0[k], &pair.vertex.t1[k], &pair.half_space.point[0][k],
              &pair.half_space.point[1][k], &pair.half_space.normal[0][k], &pair.half_space.normal[1][k]})
          *x = number();
      }
    };
    switch (family) {
      case kIntegers:  // often touches exactly, at 0, at 1 or between; a separation of 5 suits (3, 4, 0)
        fill([&] { return static_cast<double>(below(7) - 3); });
        pair.separation = below(2) == 0 ? 0 : std::array{1.0, 2.0, 5.0, 0.5}[below(4)];
        break;
      case kDoubles:
        fill([&] { return uniform(1); });
        pair.separation = below(2) == 0 ? 0 : std::fabs(uniform(0.5));
        break;
      case kGrazing: {  // f = (a t - b)^2 + c, c being 0 or a rounding of it
        fill([&] { return 0.0; });
        const double a = 1 + below(4);
        const double b = below(2) == 0 ? below(5) : std::fabs(uniform(4));
        const double c = below(3) == 0 ? 0 : std::ldexp(below(2) == 0 ? 1.0 : -1.0, -below(70));
        pair.half_space.normal = {{{-b, 1, 0}, {a - b, 1, 0}}};
        pair.vertex.t0 = {-b, c, 0, 0};
        pair.vertex.t1 = {a - b, c, 0, 0};
        break;
      }
      case kScales: {
        const int of_lengths = below(3) == 0 ? 1000 - below(8) : below(3) == 0 ? -1060 : below(200) - 100;
        const int of_normals = below(3) == 0 ? 1015 : below(3) == 0 ? -1070 : below(2000) - 1000;
        fill([&] { return uniform(1); });
        for (std::size_t k = 0; k < 3; ++k) {
          for (double* x : {&pair.vertex.t0[k], &pair.vertex.t1[k], &pair.half_space.point[0][k],
                            &pair.half_space.point[1][k]})
            *x = std::ldexp(*x, of_lengths - (below(6) == 0 ? below(80) : 0));
          for (auto& n : pair.half_space.normal)
            n[k] = std::ldexp(n[k], of_normals - (below(6) == 0 ? below(80) : 0));
        }
        pair.separation = below(2) == 0 ? 0 : std::ldexp(std::fabs(uniform(0.5)), of_lengths);
        break;
      }
      default: {  // far from p, and within a few roundings of the plane
        fill([&] { return uniform(1); });
        pair.half_space.normal[1] = pair.half_space.normal[0];
        const auto& n = pair.half_space.normal[0];
        for (auto* x : {&pair.vertex.t0, &pair.vertex.t1}) {
          const auto& p = pair.half_space.point[x == &pair.vertex.t0 ? 0 : 1];
          const double height = n[0] * ((*x)[0] - p[0]) + n[1] * ((*x)[1] - p[1]);
          (*x)[2] = p[2] - height / n[2] + std::ldexp(uniform(1), -40 - below(30));
        }
        break;
      }
    }
    vary(pair);
    return pair;
  }

 private:
  // Motions that random numbers do not produce.
  void vary(Pair& pair) {
    auto& [n0, n1] = pair.half_space.normal;
    switch (below(10)) {
      case 0:
        pair.half_space.point[1] = pair.half_space.point[0];
        [[fallthrough]];
      case 1:
        n1 = n0;
        break;
      case 2:
        for (std::size_t k = 0; k < 3; ++k) n1[k] = -n0[k];  // a half turn
        break;
      case 3:
        pair.vertex.t1 = pair.vertex.t0;
        break;
      case 4:
        pair.half_space.point[0] = {pair.vertex.t0[0], pair.vertex.t0[1], pair.vertex.t0[2]};
        break;
      case 5:
        n1 = {0, 0, 0};  // what part of a half turn may leave
        break;
      default:
        break;
    }
    if (n0 == std::array{0.0, 0.0, 0.0}) n0[below(3)] = 1;
  }
};

int pairs_of_each() {
  const char* given = std::getenv("WARMFRONT_TORTURE");
  return given != nullptr ? std::atoi(given) : 2000;
}

template <class Check>
void for_all_pairs(Check&& check) {
  Torture torture(20260711);
  for (int i = 0; i < pairs_of_each(); ++i) {
    for (int family = 0; family < Torture::kFamilies; ++family) {
      const Pair pair = torture.draw(static_cast<Torture::Family>(family));
      SCOPED_TRACE("family " + std::to_string(family) + "\n" + to_text(pair));
      check(pair);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(HalfSpaceTorture, ExactIsTheTruth) {
  int contacts = 0;
  int at_end = 0;
  for_all_pairs([&](const Pair& pair) {
    const ExactTruth truth = pair.truth();
    ElementaryCounts counts;
    const Verdict verdict = half_space_test(
        pair.vertex, pair.half_space, {.tier = Tier::kExact, .min_separation = pair.separation}, counts);
    ASSERT_EQ(verdict.contact, truth.contact);
    if (!truth.contact) return;
    ++contacts;
    at_end += truth.toi == 1;
    ASSERT_EQ(verdict.toi, truth.toi);
    ASSERT_EQ(verdict.status, truth.toi == 0 ? ContactStatus::kOverlapAtStart : ContactStatus::kHit);
  });
  EXPECT_GT(contacts, pairs_of_each());
  EXPECT_GT(at_end, pairs_of_each() / 100);
}

TEST(HalfSpaceTorture, CertifiedMissesNoneIsNeverLateAndReportsNothingFartherThanItSays) {
  for_all_pairs([&](const Pair& pair) {
    const ExactTruth truth = pair.truth();
    const ElementaryOptions options{.min_separation = pair.separation};
    ElementaryCounts counts;
    const Verdict verdict = half_space_test(pair.vertex, pair.half_space, options, counts);
    ASSERT_TRUE(verdict.contact || !truth.contact);
    if (truth.contact) {
      ASSERT_LE(verdict.toi, truth.toi);
    }
    if (!verdict.contact) return;
    ASSERT_TRUE(verdict.status == ContactStatus::kHit || verdict.status == ContactStatus::kOverlapAtStart);
    if (verdict.status == ContactStatus::kHit) {
      ASSERT_TRUE(truth.contact);
    }
    if (verdict.toi == 0) {
      ASSERT_EQ(verdict.status, ContactStatus::kOverlapAtStart);
    }
    const Verdict candidate = half_space_candidate(pair.vertex, pair.half_space, options, counts);
    ASSERT_TRUE(candidate.contact && candidate.status == ContactStatus::kBudget);
    // By its time the vertex is within a little more.
    if (!pair.comfortable()) return;
    const ExactTruth wider = pair.within(pair.separation + 0x1p-38 * pair.size()).truth();
    ASSERT_TRUE(wider.contact);
    const double n0 =
        std::hypot(pair.half_space.normal[0][0], pair.half_space.normal[0][1], pair.half_space.normal[0][2]);
    const double n1 =
        std::hypot(pair.half_space.normal[1][0], pair.half_space.normal[1][1], pair.half_space.normal[1][2]);
    const bool even = std::min(n0, n1) > 0.1 * std::max(n0, n1) &&
                      pair.half_space.normal[0][0] * pair.half_space.normal[1][0] >= 0;
    if (even && !pair.half_space.turns()) {
      ASSERT_LE(wider.toi, verdict.toi);
    }
  });
}

TEST(HalfSpaceTorture, WhatTheFilterLeavesOutNoTestReports) {
  int cleared = 0;
  for_all_pairs([&](const Pair& pair) {
    ElementaryOptions options{.min_separation = pair.separation};
    ElementaryCounts counts;
    const bool clear = HalfSpaceFilter(pair.half_space, pair.separation, {}).clear(pair.vertex);
    cleared += clear;
    for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact}) {
      options.tier = tier;
      ASSERT_FALSE(clear && half_space_test(pair.vertex, pair.half_space, options, counts).contact);
    }
    ASSERT_FALSE(clear && half_space_candidate(pair.vertex, pair.half_space, options, counts).contact);
    for (const Instant at : {Instant::kStart, Instant::kEnd}) {
      const bool then = HalfSpaceFilter(pair.half_space, pair.separation, at).clear(pair.vertex);
      options.tier = Tier::kCertified;
      ASSERT_FALSE(then && half_space_proximity(pair.vertex, pair.half_space, at, options, counts).contact);
      ASSERT_TRUE(then || !clear) << "what is separated all the time is separated at each instant";
    }
  });
  EXPECT_GT(cleared, pairs_of_each() / 4);
}

TEST(HalfSpaceTorture, ProximityIsTheTruthAtAnInstantAndDistancesAreLowerBounds) {
  for_all_pairs([&](const Pair& pair) {
    for (const Instant at : {Instant::kStart, Instant::kEnd}) {
      const Pair then = pair.at(at);
      const ExactTruth truth = then.truth();
      ElementaryOptions options{.min_separation = pair.separation};
      ElementaryCounts counts;
      const Verdict certified = half_space_proximity(pair.vertex, pair.half_space, at, options, counts);
      ASSERT_TRUE(certified.contact || !truth.contact);
      if (certified.contact && certified.status == ContactStatus::kHit) {
        ASSERT_TRUE(truth.contact);
      }
      options.tier = Tier::kExact;
      const Verdict exact = half_space_proximity(pair.vertex, pair.half_space, at, options, counts);
      ASSERT_EQ(exact.contact, truth.contact);
      if (exact.contact) {
        ASSERT_EQ(exact.toi, at == Instant::kStart ? 0 : 1);
      }
      const double distance = half_space_distance(pair.vertex, pair.half_space, at);
      ASSERT_GE(distance, 0);
      if (distance > 0 && std::isfinite(distance)) {
        ASSERT_FALSE(then.within(std::nextafter(distance, 0)).truth().contact);
      }
      if (pair.comfortable()) {
        ASSERT_TRUE(then.within(distance + 0x1p-38 * then.within(0).size()).truth().contact);
      }
    }
  });
}

TEST(HalfSpaceTorture, AShareOfEachDistanceIsKept) {
  for_all_pairs([&](const Pair& pair) {
    if (!pair.comfortable()) return;
    for (const double share : {0.1, 0.5}) {
      const KeepDistance keep{share, pair.separation};
      ElementaryCounts counts;
      const Verdict verdict = half_space_keep_distance(pair.vertex, pair.half_space, keep, 1, counts);
      const double distance = half_space_distance(pair.vertex, pair.half_space, Instant::kStart);
      const double own = std::max(pair.separation, share * distance + (1 - share) * pair.separation);
      const ExactTruth truth = pair.within(own * (1 - 0x1p-45)).truth();
      if (truth.contact) {
        ASSERT_TRUE(verdict.contact);
        ASSERT_LE(verdict.toi, truth.toi);
      }
      if (verdict.contact) {
        ASSERT_TRUE(pair.within(own + 0x1p-36 * pair.size()).truth().contact);
      }
    }
  });
}

TEST(HalfSpaceTorture, FastIsAboutRight) {
  int wrong = 0;
  int all = 0;
  for_all_pairs([&](const Pair& pair) {
    if (pair.separation > 0) return;
    ElementaryCounts counts;
    const Verdict verdict = half_space_test(pair.vertex, pair.half_space, {.tier = Tier::kFast}, counts);
    ++all;
    wrong += verdict.contact != pair.truth().contact;
  });
  EXPECT_LT(wrong, all / 4);
}

}  // namespace
}  // namespace warmfront
