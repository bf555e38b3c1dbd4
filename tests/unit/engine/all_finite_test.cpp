// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/all_finite.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace warmfront {
namespace {

template <class Real>
class AllFinite : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(AllFinite, Reals);

constexpr std::size_t kLongest = 150;  // some rounds of all lanes, and a rest

TYPED_TEST(AllFinite, HoldsForEveryFiniteNumber) {
  using Limits = std::numeric_limits<TypeParam>;
  for (std::size_t count = 0; count <= kLongest; ++count) {
    std::vector<TypeParam> numbers(count);
    for (const TypeParam x : {TypeParam{0}, -TypeParam{0}, Limits::max(), Limits::lowest(), Limits::min(),
                              Limits::denorm_min(), -Limits::denorm_min()}) {
      std::ranges::fill(numbers, x);
      EXPECT_TRUE(all_finite(numbers.data(), count)) << count << " times " << x;
    }
  }
}

TYPED_TEST(AllFinite, FailsForOneWhereverItIs) {
  using Limits = std::numeric_limits<TypeParam>;
  for (const std::size_t count : {std::size_t{1}, std::size_t{15}, std::size_t{64}, kLongest}) {
    std::vector<TypeParam> numbers(count, Limits::max());
    for (TypeParam& one : numbers) {
      for (const TypeParam x : {Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN()}) {
        one = x;
        EXPECT_FALSE(all_finite(numbers.data(), count)) << x << " as number " << &one - numbers.data();
      }
      one = Limits::max();
    }
  }
}

}  // namespace
}  // namespace warmfront
