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
#include "tests/support/failing_allocations.h"
#include "tests/support/feature_case.h"

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
