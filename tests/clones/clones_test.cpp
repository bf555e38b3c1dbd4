// SPDX-License-Identifier: Apache-2.0
// The kernels of every instruction set give the same bits, on any machine that has them. `answers` is linked
// three times: with kernels chosen as the program is loaded, as shipped; with those for AVX2 alone; and with
// the baseline's.
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "tests/support/command.h"

namespace {

std::string printed_by(const char* program) {
  const warmfront::test::CommandOutcome outcome = warmfront::test::run_command(program);
  EXPECT_EQ(outcome.code, 0) << program;
  return outcome.out;
}

/// Line by line, so that a failure names the scene, the way and the step.
void expect_same(const std::string& a, const std::string& b) {
  EXPECT_GT(a.size(), 10'000u);
  std::istringstream lines_a(a), lines_b(b);
  for (std::string line_a, line_b; std::getline(lines_a, line_a);) {
    ASSERT_TRUE(std::getline(lines_b, line_b));
    ASSERT_EQ(line_a, line_b);
  }
  EXPECT_EQ(a.size(), b.size());
}

TEST(ClonesTest, TheBaselineAndAvx2AnswerAsTheMachinesOwn) {
  const std::string own = printed_by(WARMFRONT_ANSWERS);
  {
    SCOPED_TRACE("baseline");
    expect_same(own, printed_by(WARMFRONT_ANSWERS_BASELINE));
  }
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "the rest of it: a machine without AVX2";
  SCOPED_TRACE("AVX2");
  expect_same(own, printed_by(WARMFRONT_ANSWERS_AVX2));
}

}  // namespace
