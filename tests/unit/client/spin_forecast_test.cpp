// SPDX-License-Identifier: Apache-2.0
#include "client/lib/spin_forecast.h"

#include <gtest/gtest.h>

#include <cmath>

namespace warmfront::client {
namespace {

using Time = SpinForecast::Time;

/// Waits for so many answers; how many of them came within a window, and what share of the waiting windows
/// took.
struct Course {
  int hits = 0;
  double share = 0;
};
template <class WaitOf>
Course course(SpinForecast& forecast, int answers, WaitOf wait_of) {
  Course course;
  Time waited{0}, spun{0};
  for (int i = 0; i < answers; ++i) {
    const Time after = wait_of(i);
    const auto window = forecast.next();
    forecast.came(after, window);
    waited += after;
    if (!window) continue;
    EXPECT_LE(Time(0), window->begin);
    EXPECT_LT(window->begin, window->end);
    spun += std::max(Time(0), std::min(after, window->end) - window->begin);
    course.hits += window->begin <= after && after <= window->end ? 1 : 0;
  }
  course.share = spun / waited;
  return course;
}

TEST(SpinForecastTest, ShortAnswersAreAwaitedFromTheBeginning) {
  SpinForecast forecast;
  EXPECT_EQ(course(forecast, 100, [](int i) { return Time(20 + i % 7 * 20); }).hits, 100);
  ASSERT_TRUE(forecast.next());
  EXPECT_EQ(forecast.next()->begin, Time(0));
}

TEST(SpinForecastTest, RegularAnswersAreAwaitedWhenTheyAreDue) {
  for (const double ms : {0.5, 3.0, 20.0}) {
    SpinForecast forecast;
    // The first ones are not known.
    course(forecast, 10, [&](int i) { return Time(1000 * ms + i % 3 * 40); });
    const Course known = course(forecast, 100, [&](int i) { return Time(1000 * ms + i % 3 * 40); });
    EXPECT_GE(known.hits, 95) << ms;
    EXPECT_LE(known.share, ms < 1 ? 0.7 : 0.15) << ms;
  }
}

TEST(SpinForecastTest, OneThatIsFarOffChangesNothing) {
  SpinForecast forecast;
  const auto wait_of = [](int i) { return i % 25 == 24 ? Time(40'000) : Time(3000 + i % 5 * 50); };
  course(forecast, 10, wait_of);
  EXPECT_GE(course(forecast, 100, wait_of).hits, 85);
}

TEST(SpinForecastTest, IrregularAnswersAreAwaitedAsleep) {
  SpinForecast forecast;
  const auto wait_of = [](int i) { return Time(1000.0 * (1 + i * 7 % 40)); };
  course(forecast, 20, wait_of);
  EXPECT_LE(course(forecast, 200, wait_of).share, 0.02);
}

TEST(SpinForecastTest, WindowsThatAreMissedBecomeRare) {
  SpinForecast forecast;
  // Each is later than all before it.
  int windows = 0;
  for (int i = 0; i < 400; ++i) {
    const auto window = forecast.next();
    windows += window ? 1 : 0;
    forecast.came(Time(1000 * std::pow(1.2, i % 50)), window);
  }
  EXPECT_LE(windows, 80);
}

}  // namespace
}  // namespace warmfront::client
