// SPDX-License-Identifier: Apache-2.0
// Memory runs out during an exact test, at every allocation in turn: it throws, leaks nothing, and answers
// right when repeated. GMP, which would end the process, never allocates itself.
#include <gmp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include "engine/elementary/exact.h"
#include "engine/elementary/exact_near.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/feature_case.h"
#include "tests/support/near_torture.h"

namespace warmfront::testing {
namespace {

std::atomic<long> asked_by_gmp{0};

void* allocate(std::size_t size) {
  ++asked_by_gmp;
  return std::malloc(size);
}
void* reallocate(void* memory, std::size_t /*from*/, std::size_t to) {
  ++asked_by_gmp;
  return std::realloc(memory, to);
}
void release(void* memory, std::size_t /*size*/) {
  std::free(memory);
}

// Coordinates that span all bits of double's range, and few bits; intersecting, or in a plane.
FeatureCase draw(std::mt19937_64& random) {
  const bool flat = random() % 4 == 0;
  const int range = random() % 2 == 0 ? 1 : 500;
  const auto coordinate = [&] {
    const double mantissa = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
    return std::ldexp(mantissa, -static_cast<int>(random() % static_cast<unsigned>(2 * range)));
  };
  Points t0;
  Points t1;
  for (auto* end : {&t0, &t1}) {
    for (auto& p : *end) p = {coordinate(), coordinate(), flat ? 0 : coordinate()};
  }
  return {random() % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge, t0, t1};
}

TEST(ExactMemory, GmpIsNeverLeftToLookForMemory) {
  mp_set_memory_functions(allocate, reallocate, release);
  std::mt19937_64 random(7);
  std::uint64_t exact_tests = 0;
  for (int trial = 0; trial < 3'000; ++trial) exact_test(draw(random).features(), 1, exact_tests);
  mp_set_memory_functions(nullptr, nullptr, nullptr);
  EXPECT_GT(exact_tests, 500U);
  EXPECT_EQ(asked_by_gmp, 0);
}

// The families that need the longest operands, and any separation on queries of all of double's range.
TEST(ExactMemory, GmpIsNeverLeftToLookForMemoryWithASeparation) {
  mp_set_memory_functions(allocate, reallocate, release);
  asked_by_gmp = 0;
  std::mt19937_64 random(9);
  std::uint64_t exact_tests = 0;
  for (int trial = 0; trial < 25; ++trial) {
    for (const NearFamily& family : near_families()) {
      for (const ContactKind kind : {ContactKind::kVertexFace, ContactKind::kEdgeEdge}) {
        const NearCase made = family.make(random, kind);
        exact_near_test(made.query.features(), made.separation, 1, exact_tests);
      }
    }
  }
  for (int trial = 0; trial < 150; ++trial) {
    const FeatureCase query = draw(random);
    exact_near_test(query.features(), any_separation(random, query), 1, exact_tests);
  }
  mp_set_memory_functions(nullptr, nullptr, nullptr);
  EXPECT_GT(exact_tests, 50U);
  EXPECT_EQ(asked_by_gmp, 0);
}

TEST(ExactMemory, WhatFailsWithASeparationThrowsAndKeepsNothing) {
  std::mt19937_64 random(10);
  int failures = 0;
  for (int trial = 0; trial < 40 && failures < 2'000; ++trial) {
    const NearFamily& family = near_families()[static_cast<std::size_t>(trial) % near_families().size()];
    const NearCase made =
        family.make(random, trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge);
    std::uint64_t exact_tests = 0;
    const Verdict right = exact_near_test(made.query.features(), made.separation, 1, exact_tests);
    const std::size_t live = live_bytes();
    long step = 1;
    bool failed = true;
    for (long n = 0; failed; n += step, step += n > 40 ? 7 : 0) {  // the first ones, then ever fewer
      try {
        const FailingAllocations failing(n);
        exact_near_test(made.query.features(), made.separation, 1, exact_tests);
        failed = false;
      } catch (const std::bad_alloc&) {
        ++failures;
      }
      ASSERT_EQ(live_bytes(), live) << trial << ", allocation " << n;
    }
    const Verdict again = exact_near_test(made.query.features(), made.separation, 1, exact_tests);
    ASSERT_EQ(again.contact, right.contact);
    ASSERT_EQ(again.toi, right.toi);
  }
  EXPECT_GT(failures, 200);
}

TEST(ExactMemory, WhatFailsThrowsAndKeepsNothing) {
  std::mt19937_64 random(8);
  int failures = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const FeatureCase query = draw(random);
    std::uint64_t exact_tests = 0;
    const Verdict right = exact_test(query.features(), 1, exact_tests);
    const std::size_t live = live_bytes();
    bool failed = true;
    for (long n = 0; failed; ++n) {
      try {
        const FailingAllocations failing(n);
        exact_test(query.features(), 1, exact_tests);
        failed = false;
      } catch (const std::bad_alloc&) {
        ++failures;
      }
      ASSERT_EQ(live_bytes(), live) << trial << ", allocation " << n;
    }
    const Verdict again = exact_test(query.features(), 1, exact_tests);
    ASSERT_EQ(again.contact, right.contact);
    ASSERT_EQ(again.toi, right.toi);
  }
  EXPECT_GT(failures, 500);
}

}  // namespace
}  // namespace warmfront::testing
