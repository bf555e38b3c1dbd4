// SPDX-License-Identifier: Apache-2.0
// What a load says while it runs, and what its report says of an outage.
#include "client/cli/load/live.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/load/report.h"

namespace warmfront::client::load {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Plan plan() {
  Plan plan;
  plan.sessions = 4;
  plan.warmup = 1;
  plan.duration = 8;
  return plan;
}

/// `seconds` of one frame and ten contacts each, until `at`.
Shown shown(double at, int seconds) {
  Shown shown;
  Histogram one;
  one.record(2);
  for (int k = 0; k < seconds; ++k)
    shown.add({.at = at - seconds + 1 + k, .seconds = 1, .frames = 1, .contacts = 10, .errors = 1}, one);
  return shown;
}

TEST(LoadLive, ALineIsOfTheTimeSinceTheLineBefore) {
  EXPECT_EQ(
      live_line(plan(), shown(5, 5)),
      "    5 of 9 s, measured, 4 sessions, closed loop; in the last 5 s: 1 frames/s, 10 contacts/s, p50 "
      "2.00 ms, p99 2.00 ms; 5 errors so far");
  Shown quiet;
  quiet.add({.at = 5, .seconds = 5}, {});
  EXPECT_THAT(live_line(plan(), quiet), HasSubstr("; in the last 5 s no answers; 0 errors"));
}

TEST(LoadLive, ALineNeverShowsMoreSecondsThanTheWhole) {
  EXPECT_THAT(live_line(plan(), shown(9.6, 1)),
              StartsWith("    9 of 9 s, ended, answers are due, 4 sessions"));
}

TEST(LoadLive, ALineSaysHowManySessionsAreNotServedAndSinceWhen) {
  Shown now = shown(5, 4);
  EXPECT_THAT(live_line(plan(), now), EndsWith("so far"));
  now.add({.at = 6, .without_daemon = 4, .unserved_since = 4.2}, {});
  EXPECT_THAT(live_line(plan(), now), EndsWith("; now 4 of 4 sessions without a daemon, since 4.2 s"));
  now.add({.at = 7, .without_daemon = 3, .refused = 1, .unserved_since = 4.2}, {});
  EXPECT_THAT(live_line(plan(), now),
              EndsWith("; now 3 of 4 sessions without a daemon and 1 of 4 sessions refused, since 4.2 s"));
  now.add({.at = 8, .refused = 1, .unserved_since = 7.5}, {});
  EXPECT_THAT(live_line(plan(), now), EndsWith("; now 1 of 4 sessions refused, since 7.5 s"));
}

TEST(LoadReport, RatesOverTimeInWhichNoSessionWasServedAreMarked) {
  Measured measured;
  measured.plan = plan();
  measured.seconds = 8;
  measured.unserved_seconds = 5.04;
  Report report;
  report.points.push_back({measured, {}});
  EXPECT_THAT(
      format_text(report),
      HasSubstr("warning: no session had a daemon that served it for 5.0 of the 8.0 measured seconds: "
                "frames/s and contacts/s count this time in\n"));
  report.points.front().measured.unserved_seconds = 0;
  EXPECT_THAT(format_text(report), Not(HasSubstr("no session")));
}

}  // namespace
}  // namespace warmfront::client::load
