// SPDX-License-Identifier: Apache-2.0
// The exact tier with a separation against the oracle for separations, to the last bit of the time, on the
// families made for it and on the torture families with separations of every size; and the certified tier
// beside it: it misses nothing and is never late. $WARMFRONT_TORTURE_CASES multiplies the number of cases.
#include "tests/support/near_torture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>

#include "engine/elementary/certified.h"
#include "engine/elementary/exact_near.h"
#include "engine/narrow_phase/coplanarity_filter.h"
#include "engine/narrow_phase/feature_block.h"
#include "tests/support/near_oracle.h"
#include "tests/support/torture.h"

namespace warmfront {
namespace {

using testing::ExactTruth;
using testing::NearCase;

int cases(int base) {
  const char* given = std::getenv("WARMFRONT_TORTURE_CASES");
  return base * std::max(1, given == nullptr ? 1 : std::atoi(given));
}

struct Tally {
  int at_start = 0;
  int later = 0;
  int none = 0;
  std::uint64_t exact_tests = 0;
  double slowest_us = 0;
};

void expect_truth(const NearCase& made, Tally& tally) {
  const ExactTruth truth = testing::near_truth(made.query.features(), made.separation);
  (truth.at_start ? tally.at_start : truth.contact ? tally.later : tally.none) += 1;

  const auto begin = std::chrono::steady_clock::now();
  const Verdict verdict = exact_near_test(made.query.features(), made.separation, 1, tally.exact_tests);
  const std::chrono::duration<double, std::micro> us = std::chrono::steady_clock::now() - begin;
  tally.slowest_us = std::max(tally.slowest_us, us.count());
  ASSERT_EQ(verdict.contact, truth.contact);
  if (truth.contact) {
    ASSERT_EQ(verdict.toi, truth.toi);
    ASSERT_EQ(verdict.status, truth.toi == 0 ? ContactStatus::kOverlapAtStart : ContactStatus::kHit);
  }

  const Verdict certified = certified_test(made.query.features(), {.min_separation = made.separation});
  const FeaturePair pair{{0, 1, 2, 3}, 0, 0, made.query.kind};
  std::uint16_t survivor = 0;
  if (truth.contact) {
    ASSERT_TRUE(certified.contact);
    ASSERT_LE(certified.toi, truth.toi);
    ASSERT_EQ(coplanarity_filter({&pair, 1}, made.query.vertices, {&made.separation, 1}, &survivor), 1U);
  } else {
    ASSERT_FALSE(certified.contact && certified.status == ContactStatus::kHit);
  }
}

void print(std::string_view name, const Tally& tally) {
  std::cout << name << ": " << tally.at_start << " at the start, " << tally.later << " later, " << tally.none
            << " never; " << tally.exact_tests << " by GMP, slowest query " << tally.slowest_us << " us\n";
}

ContactKind kind_of(int trial) {
  return trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
}

TEST(NearTorture, AtExactlyTheSeparation) {
  for (const testing::NearFamily& family : testing::near_families()) {
    std::mt19937_64 random(2009);
    Tally tally;
    for (int trial = 0; trial < cases(750); ++trial) {
      const NearCase made = family.make(random, kind_of(trial));
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(trial) + " " + to_text(made));
      ASSERT_NO_FATAL_FAILURE(expect_truth(made, tally));
    }
    print(family.name, tally);
    EXPECT_GT(tally.later, cases(750) / 20);
    EXPECT_GT(tally.none, cases(750) / 20);
  }
}

TEST(NearTorture, SeparationsOfEverySize) {
  int later = 0;
  for (const testing::TortureFamily& family : testing::torture_families()) {
    std::mt19937_64 random(2010);
    Tally tally;
    for (int trial = 0; trial < cases(15); ++trial) {
      const testing::FeatureCase query = family.make(random, kind_of(trial));
      const NearCase made{query, testing::any_separation(random, query)};
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(trial) + " " + to_text(made));
      ASSERT_NO_FATAL_FAILURE(expect_truth(made, tally));
    }
    print(family.name, tally);
    later += tally.later;
  }
  EXPECT_GT(later, cases(15) * 2);
}

}  // namespace
}  // namespace warmfront
