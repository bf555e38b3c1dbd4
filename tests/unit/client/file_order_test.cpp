// SPDX-License-Identifier: Apache-2.0
// Files that are frames, in and out of the order of their numbers.
#include "client/io/file_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace warmfront::client {
namespace {

using Names = std::vector<std::string>;

TEST(FileOrder, NumbersThatAscendAreInOrder) {
  for (const Names& names : {Names{"t1.ply", "t2.ply", "t009.ply", "t10.ply"},
                             {"a/b2.obj", "a/b10.obj"},
                             {"t10.ply", "s2.ply"},
                             {"t10.ply", "t2.obj"},
                             {"x.ply", "a.ply"},
                             {"t7.ply"},
                             {},
                             {"07", "8"},
                             {"t00.ply", "t0.ply"}})
    EXPECT_FALSE(numbers_out_of_order(names));
}

TEST(FileOrder, AShellsOrderIsNoted) {
  EXPECT_THAT(*numbers_out_of_order(Names{"t1.obj", "t10.obj", "t11.obj", "t2.obj"}),
              ::testing::HasSubstr("t11.obj comes before t2.obj"));
  EXPECT_TRUE(numbers_out_of_order(Names{"9", "8"}));
}

}  // namespace
}  // namespace warmfront::client
