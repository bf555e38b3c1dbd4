// SPDX-License-Identifier: Apache-2.0
// The histogram's quantiles against those of the sorted values.
#include "client/cli/load/histogram.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/cli/load/tally.h"

namespace warmfront::client::load {
namespace {

double exact_quantile(const std::vector<double>& sorted, double q) {
  const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

RC_GTEST_PROP(LoadHistogram, QuantilesAreWithinTheStatedError, ()) {
  // From a nanosecond to days, as evenly over the magnitudes as over the values within one.
  std::vector<double> values;
  for (int i = *rc::gen::inRange(1, 300); i > 0; --i)
    values.push_back(std::ldexp(1 + 1e-3 * *rc::gen::inRange(0, 1000), *rc::gen::inRange(-20, 30)));
  Histogram whole, left, right;
  for (std::size_t i = 0; i < values.size(); ++i) {
    whole.record(values[i]);
    (i % 3 == 0 ? left : right).record(values[i]);
  }
  left.merge(right);
  std::ranges::sort(values);
  RC_ASSERT(whole.count() == values.size());
  for (const double q : {0.0, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const double expected = exact_quantile(values, q);
    // Nanoseconds are cut off before the bucket is sought.
    RC_ASSERT(std::fabs(whole.quantile(q) - expected) <= Histogram::kRelativeError * expected + 1e-6);
    RC_ASSERT(left.quantile(q) == whole.quantile(q));
  }
  RC_ASSERT(whole.quantile(1) == values.back());
  RC_ASSERT(left.max_ms() == values.back());
}

TEST(LoadHistogram, AClearedOneIsAsNew) {
  Histogram cleared, fresh;
  for (const double ms : {0.5, 7.0, 300.0}) cleared.record(ms);
  cleared.clear();
  EXPECT_EQ(cleared.count(), 0u);
  EXPECT_EQ(cleared.quantile(0.5), 0);
  for (const double ms : {2.0, 3.0, 5.0}) {
    cleared.record(ms);
    fresh.record(ms);
  }
  for (const double q : {0.0, 0.5, 0.99, 1.0}) EXPECT_EQ(cleared.quantile(q), fresh.quantile(q));
  EXPECT_EQ(cleared.mean_ms(), fresh.mean_ms());
  Histogram merged;
  merged.merge(cleared);
  EXPECT_EQ(merged.quantile(0.5), fresh.quantile(0.5));
}

TEST(LoadTally, WhatCameBeforeTheMeasuredPeriodIsForgotten) {
  Tally tally;
  Answer answer;
  answer.travel.sent_bytes = 10;
  tally.measured({.due = 1, .sent = 2, .answered = 5, .own_late_ms = 3}, answer);
  tally.begin_measuring();
  EXPECT_EQ(tally.frames, 0u);
  EXPECT_EQ(tally.sent_bytes, 0u);
  tally.measured({.due = 1, .sent = 1.5, .answered = 2, .own_late_ms = 0.5}, answer);
  EXPECT_EQ(tally.frames, 1u);
  EXPECT_EQ(tally.sent_bytes, 10u);
  for (const Histogram* one : {&tally.latency, &tally.latency_of[0], &tally.round_trip, &tally.own_late,
                               &tally.parts[kLate], &tally.parts[kWire]})
    EXPECT_EQ(one->count(), 1u);
  EXPECT_EQ(tally.latency.max_ms(), 1000);
  EXPECT_EQ(tally.round_trip.max_ms(), 500);
}

TEST(LoadHistogram, WhatCannotBeIsHeldAtTheEnds) {
  Histogram h;
  EXPECT_EQ(h.quantile(0.5), 0);
  h.record(-3);
  EXPECT_EQ(h.max_ms(), 0);
  h.record(1e300);
  EXPECT_DOUBLE_EQ(h.max_ms(), 365 * 86400e3);
  EXPECT_EQ(h.count(), 2u);
}

}  // namespace
}  // namespace warmfront::client::load
