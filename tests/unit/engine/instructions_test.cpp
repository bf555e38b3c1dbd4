// SPDX-License-Identifier: Apache-2.0
// What this machine has is read once more, from where the system tells it.
#include "engine/instructions.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

namespace warmfront {
namespace {

bool system_says(const std::string& flag) {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("flags")) return (line + " ").find(" " + flag + " ") != std::string::npos;
  return false;
}

TEST(Instructions, OnlyMachinesWithoutAvx2AreSaidToBeSlow) {
  const bool made_for_avx2 = instruction_sets().find("avx2") != std::string::npos;
  EXPECT_EQ(why_instructions_are_slow().empty(), !made_for_avx2 || system_says("avx2"));
  EXPECT_TRUE(made_for_avx2 || instruction_sets() == "baseline") << instruction_sets();
}

}  // namespace
}  // namespace warmfront
