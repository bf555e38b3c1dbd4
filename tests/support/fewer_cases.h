// SPDX-License-Identifier: Apache-2.0
// Properties of RapidCheck of which a case takes long: as RC_GTEST_PROP, but of 50 cases rather than 100,
// unless RC_PARAMS says max_success, and another number than these 100.
#pragma once

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <sstream>

namespace warmfront::testing {

inline void check_fewer_cases(void (*property)()) {
  rc::detail::TestMetadata metadata;
  metadata.id = metadata.description = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  if (params.maxSuccess == rc::detail::TestParams{}.maxSuccess) params.maxSuccess /= 2;
  const auto result = rc::detail::checkTestable(property, metadata, params);
  std::ostringstream told;
  rc::detail::printResultMessage(result, told);
  EXPECT_TRUE(result.is<rc::detail::SuccessResult>()) << told.str();
}

}  // namespace warmfront::testing

/// A property without arguments.
#define WARMFRONT_PROPERTY_OF_FEWER_CASES(Suite, Name)                   \
  void property_##Suite##_##Name();                                      \
  TEST(Suite, Name) {                                                    \
    ::warmfront::testing::check_fewer_cases(&property_##Suite##_##Name); \
  }                                                                      \
  void property_##Suite##_##Name()
