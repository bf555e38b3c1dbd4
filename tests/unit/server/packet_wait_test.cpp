// SPDX-License-Identifier: Apache-2.0
#include "server/process/packet_wait.h"

#include <gtest/gtest.h>

namespace warmfront::server {
namespace {

using When = PacketWait::When;
using Time = PacketWait::Time;

/// Of so many waits, how many were without sleeping.
int tried(PacketWait& wait, When when, int waits, bool came) {
  int count = 0;
  for (int i = 0; i < waits; ++i) {
    if (wait.next(when) == Time(0)) continue;
    ++count;
    wait.ended(when, came);
  }
  return count;
}

TEST(PacketWaitTest, WhatComesInTimeIsAlwaysWaitedFor) {
  PacketWait wait;
  EXPECT_EQ(tried(wait, When::kLater, 1000, true), 1000);
  EXPECT_EQ(wait.next(When::kLater, Time(1500)), Time(1500));
  EXPECT_EQ(wait.next(When::kSoon, Time(1500)), PacketWait::kSoon);
}

TEST(PacketWaitTest, WhatComesLaterIsWaitedForLessAndLessOften) {
  PacketWait wait;
  EXPECT_EQ(tried(wait, When::kLater, 255, false), 8);
  EXPECT_LE(tried(wait, When::kLater, 2550, false), 10);
  // Of the rest of a frame that says nothing.
  EXPECT_EQ(tried(wait, When::kSoon, 100, true), 100);
}

TEST(PacketWaitTest, OneInTimeIsEnoughToBeWaitedForAgain) {
  PacketWait wait;
  tried(wait, When::kLater, 255, false);
  int waits = 0;
  while (wait.next(When::kLater) == Time(0)) ++waits;
  EXPECT_LE(waits, 255);
  wait.ended(When::kLater, true);
  EXPECT_EQ(tried(wait, When::kLater, 100, true), 100);
}

TEST(PacketWaitTest, WithoutAnyTimeNothingIsWaitedFor) {
  PacketWait wait;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(wait.next(When::kLater, Time(0)), Time(0));
  EXPECT_GT(wait.next(When::kSoon, Time(0)), Time(0));
}

}  // namespace
}  // namespace warmfront::server
