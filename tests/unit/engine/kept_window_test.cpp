// SPDX-License-Identifier: Apache-2.0
#include "engine/state/kept_window.h"

#include <gtest/gtest.h>

#include <array>

namespace warmfront {
namespace {

/// Turns until culls go by the widest.
int turns_of(double widest, double length) {
  KeptWindow window;
  window.begin();
  int turns = 1;
  for (; window.narrow(widest, 0.5, length) < widest; ++turns) {
    EXPECT_TRUE(window.narrowed());
    window.next(std::array{2.0});
  }
  EXPECT_FALSE(window.narrowed());
  return turns;
}

TEST(KeptWindow, WhatIsNotMuchWiderIsAskedAtOnce) {
  EXPECT_EQ(turns_of(4, 1), 1);
  EXPECT_EQ(turns_of(1e9, 0), 1) << "nothing is known of edges";
  EXPECT_EQ(turns_of(200, 1), 3);
}

TEST(KeptWindow, EdgesThatAreShortBesideTheMotionDoNotRepeatItForLong) {
  EXPECT_LE(turns_of(1e300, 1e-300), 9);
}

}  // namespace
}  // namespace warmfront
