// SPDX-License-Identifier: Apache-2.0
// Sweeps as text, and when frames are due.
#include "client/cli/load/schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "client/cli/load/sweep.h"

namespace warmfront::client::load {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<double> due(Schedule schedule, int count) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(schedule.next());
  return times;
}

TEST(LoadSweep, ReadsNumbersFactorsAndSteps) {
  EXPECT_THAT(parse_sweep("16", true).value(), ElementsAre(16));
  EXPECT_THAT(parse_sweep("1:64:x2", true).value(), ElementsAre(1, 2, 4, 8, 16, 32, 64));
  EXPECT_THAT(parse_sweep("10:35:+10", true).value(), ElementsAre(10, 20, 30));
  EXPECT_THAT(parse_sweep("1:4:x1.2", true).value(), ElementsAre(1, 2, 3, 4)) << "rounded, and each once";
  const auto tenths = parse_sweep("0.1:0.5:+0.1", false).value();
  ASSERT_EQ(tenths.size(), 5u) << "rounding does not lose the last";
  EXPECT_DOUBLE_EQ(tenths.back(), 0.5);
}

TEST(LoadSweep, RefusesWhatIsNoSweep) {
  for (const char* text :
       {"", "x", "0", "-1", "nan", "inf", "1:", "1:2", "1:2:", "1:2:2", "4:2:x2", "1:2:x1", "1:2:x0.5",
        "1:2:+0", "1:2:+-1", "1:8:x2:x2", "1 ", "1:100000:+1", "1:2:x1.0000000001"}) {
    const auto sweep = parse_sweep(text, false);
    ASSERT_FALSE(sweep.ok()) << text;
    EXPECT_THAT(sweep.error().message, HasSubstr("FIRST:LAST:xFACTOR")) << text;
  }
  EXPECT_FALSE(parse_sweep("1.5", true).ok()) << "a session is created completely or not at all";
}

TEST(LoadSchedule, ConstantGapsBeginAtTheirPhase) {
  EXPECT_THAT(due({Arrival::kConstant, 4, 0, 0.5, 1}, 3), ElementsAre(0.125, 0.375, 0.625));
}

TEST(LoadSchedule, SessionsSideBySideAreEvenlySpaced) {
  // Four sessions of 25 frames a second each are one load of 100 a second.
  for (int i = 0; i < 4; ++i)
    EXPECT_THAT(due({Arrival::kConstant, 25, 0, i / 4.0, 1}, 2),
                ElementsAre(DoubleNear(0.01 * i, 1e-12), DoubleNear(0.04 + 0.01 * i, 1e-12)));
}

TEST(LoadSchedule, InTheRampTheRateGrowsEvenly) {
  // 100 a second after 2 seconds: 25 frames in the first of them, 75 in the second, then 100 each.
  const auto times = due({Arrival::kConstant, 100, 2, 0, 1}, 300);
  EXPECT_NEAR(times[25], 1, 1e-12);
  EXPECT_NEAR(times[100], 2, 1e-12);
  EXPECT_NEAR(times[200], 3, 1e-12);
  EXPECT_TRUE(std::ranges::is_sorted(times));
}

TEST(LoadSchedule, PoissonGapsAreExponentialAndTheSeedDecidesThem) {
  constexpr int kCount = 20000;
  constexpr double kRate = 50;
  const auto times = due({Arrival::kPoisson, kRate, 0, 0, 7}, kCount);
  EXPECT_EQ(times, due({Arrival::kPoisson, kRate, 0, 0, 7}, kCount));
  EXPECT_NE(times, due({Arrival::kPoisson, kRate, 0, 0, 8}, kCount));
  double last = 0, sum = 0, squares = 0;
  int long_gaps = 0;
  for (const double time : times) {
    const double gap = kRate * (time - last);
    ASSERT_GE(gap, 0);
    sum += gap;
    squares += gap * gap;
    long_gaps += gap > 2;
    last = time;
  }
  // Mean 1, second moment 2, P(gap > 2) = e^-2, to about five of their standard errors.
  EXPECT_NEAR(sum / kCount, 1, 0.035);
  EXPECT_NEAR(squares / kCount, 2, 0.16);
  EXPECT_NEAR(1.0 * long_gaps / kCount, std::exp(-2), 0.013);
}

}  // namespace
}  // namespace warmfront::client::load
