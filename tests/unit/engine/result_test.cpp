// SPDX-License-Identifier: Apache-2.0
// A result whose value is taken unchecked, and which holds an error, ends with that error's message.
#include "engine/result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace warmfront {
namespace {

using ::testing::HasSubstr;

TEST(ResultDeathTest, AnUncheckedValueDiesWithTheErrorsOwnMessage) {
  const Result<int> refused = invalid_argument("faces[3][0]: vertex index 9 is not in [0, 6)");
  EXPECT_DEATH((void)[&]() noexcept { return refused.value(); }(),
               "BadResultAccess(.|\n)*faces\\[3\\]\\[0\\]: vertex index 9 is not in \\[0, 6\\)");
}

TEST(Result, TheExceptionCarriesTheError) {
  Result<std::unique_ptr<int>> refused = Error{ErrorCode::kUnavailable, "nobody answers"};
  try {
    (void)std::move(refused).value();
    FAIL() << "there is no value";
  } catch (const BadResultAccess& error) {
    EXPECT_EQ(error.error().code, ErrorCode::kUnavailable);
    EXPECT_EQ(error.error().message, "nobody answers");
    EXPECT_THAT(error.what(), HasSubstr("nobody answers"));
  }
  EXPECT_THROW((void)Result<int>(3).error(), std::logic_error);
}

TEST(Result, AValueIsGivenAsItIs) {
  Result<std::unique_ptr<int>> made = std::make_unique<int>(7);
  EXPECT_EQ(*made.value(), 7);
  const std::unique_ptr<int> taken = std::move(made).value();
  EXPECT_EQ(*taken, 7);
}

}  // namespace
}  // namespace warmfront
