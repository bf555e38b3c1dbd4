// SPDX-License-Identifier: Apache-2.0
// Limits as text and as verdicts, and the search for the knee.
#include "client/cli/load/limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "client/cli/load/knee.h"

namespace warmfront::client::load {
namespace {

using ::testing::HasSubstr;

/// 100 frames of 1, 2, ..., 100 ms in two seconds, and two errors.
Measured measured() {
  Measured m;
  for (int ms = 1; ms <= 100; ++ms) m.tally.latency.record(ms);
  m.tally.frames = 100;
  m.seconds = 2;
  m.tally.error({ErrorCode::kUnavailable, "gone"});
  m.tally.error({ErrorCode::kUnavailable, "gone"});
  return m;
}

Verdict verdict(const char* text) {
  return judge(parse_limit(text).value(), measured());
}

TEST(LoadLimits, TimesHaveUnitsAndCountsHaveNone) {
  EXPECT_EQ(parse_limit("p99=20ms").value().value, 20);
  EXPECT_EQ(parse_limit("p99.9=0.5s").value().value, 500);
  EXPECT_EQ(parse_limit("max=250us").value().value, 0.25);
  EXPECT_EQ(parse_limit("errors=0").value().value, 0);
  EXPECT_EQ(parse_limit("p99=20ms").value().text(), "p99=20ms");
  for (const char* text :
       {"p99", "p99=", "p99=20", "p99=-1ms", "p99=nanms", "p98=1ms", "errors=1ms", "=1", ""})
    EXPECT_FALSE(parse_limit(text).ok()) << text;
  EXPECT_THAT(parse_limit("p98=1ms").error().message, HasSubstr("p50, p90, p99, p99.9, max"));
}

TEST(LoadLimits, ValuesBeyondALimitMissIt) {
  EXPECT_TRUE(verdict("max=100ms").kept);
  EXPECT_FALSE(verdict("max=99.9ms").kept);
  EXPECT_EQ(verdict("max=99ms").text(), "missed max=99ms by 1 ms (100 ms)");
  EXPECT_EQ(verdict("errors=2").text(), "kept errors=2 (2)");
  EXPECT_FALSE(verdict("errors=1").kept);
  EXPECT_TRUE(verdict("p50=51ms").kept);
  EXPECT_TRUE(verdict("frames-per-second=50").kept) << "a rate is a lower limit";
  EXPECT_FALSE(verdict("frames-per-second=51").kept);
  EXPECT_FALSE(judge(parse_limit("p99=20ms").value(), Measured{}).kept)
      << "without measurements no limit on time is met";
  EXPECT_TRUE(judge(parse_limit("errors=0").value(), Measured{}).kept);
}

RC_GTEST_PROP(LoadKnee, IsFoundOnASyntheticLatencyCurve, ()) {
  // The latency of a queue that serves `capacity` frames a second grows as 1 / (1 - rate / capacity).
  const double capacity = 0.5 * *rc::gen::inRange(2, 200000);
  const double factor = *rc::gen::inRange(2, 50);
  const double start = 0.25 * *rc::gen::inRange(1, 4000);
  const double knee = capacity * (1 - 1 / factor);
  KneeSearch search(start);
  int tries = 0;
  while (const auto rate = search.next()) {
    RC_ASSERT(++tries <= 40);
    search.tried(*rate < capacity && 1 / (1 - *rate / capacity) <= factor);
  }
  RC_PRE(search.highest_held().has_value());
  RC_ASSERT(*search.highest_held() <= knee * (1 + 1e-9));
  RC_ASSERT(*search.highest_held() * 1.05 >= knee * (1 - 1e-9));
  RC_ASSERT(*search.lowest_failed() > knee * (1 - 1e-9));
}

TEST(LoadKnee, EndsWhereNoRateOrEveryRateHolds) {
  KneeSearch never(100), always(100);
  int tries = 0;
  while (never.next() && ++tries < 1000) never.tried(false);
  EXPECT_LT(tries, 20);
  EXPECT_FALSE(never.highest_held());
  tries = 0;
  while (always.next() && ++tries < 1000) always.tried(true);
  EXPECT_LT(tries, 40);
  EXPECT_FALSE(always.lowest_failed());
}

TEST(LoadTally, PartsAddUpToTheLatency) {
  Answer answer;
  answer.travel = {
      .encode_ms = 0.5, .decode_ms = 0.25, .queue_ms = 2, .sent_bytes = 10, .received_bytes = 20};
  answer.statistics.ms = {.total = 4, .refit = 1, .front = 1.5, .elementary = 0.75, .adjacent = 0.25};
  Tally tally;
  tally.measured({.due = 1, .sent = 1.003, .answered = 1.013, .own_late_ms = 0.125}, answer);
  double sum = 0;
  for (const Histogram& part : tally.parts) sum += part.sum_ms();
  EXPECT_NEAR(tally.latency.sum_ms(), 13, 1e-9);
  EXPECT_NEAR(sum, 13, 1e-9);
  EXPECT_NEAR(tally.parts[kLate].sum_ms(), 3, 1e-9);
  EXPECT_NEAR(tally.parts[kWire].sum_ms(), 10 - 0.5 - 0.25 - 2 - 4, 1e-9);
  EXPECT_NEAR(tally.parts[kRest].sum_ms(), 0.5, 1e-9);
  EXPECT_NEAR(tally.round_trip.sum_ms(), 10, 1e-9);
}

}  // namespace
}  // namespace warmfront::client::load
