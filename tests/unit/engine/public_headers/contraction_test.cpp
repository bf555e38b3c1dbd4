// SPDX-License-Identifier: Apache-2.0
// The public headers in a program that is compiled for fused multiply-adds, as with -march=native: what they compute is
// what the engine computes, bit for bit.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "engine/collider.h"
#include "engine/eigen.h"
#include "engine/part_way.h"
#include "engine/pose.h"
#include "engine/screw.h"

namespace warmfront {
namespace {

// Each operation through memory: rounded, whatever the compiler would rather do.
double rounded(double value) {
  volatile double kept = value;
  return kept;
}

std::array<double, 3> place_by_operations(const Pose& pose, const std::array<double, 3>& x) {
  std::array<double, 3> placed{};
  for (std::size_t row = 0; row < 3; ++row) {
    const double* m = pose.matrix.data() + 4 * row;
    const double two = rounded(rounded(m[0] * x[0]) + rounded(m[1] * x[1]));
    placed[row] = rounded(rounded(two + rounded(m[2] * x[2])) + m[3]);
  }
  return placed;
}

bool fuses_when_asked() {
  volatile double a = 1 + 0x1p-30, b = -1 - 0x1p-29;
  const double x = a, y = b;
  return x * x + y != 0;  // 2^-60, which a product of its own loses
}

TEST(PublicHeaders, PlaceAsTheEngineDoesWhereTheProgramFuses) {
#if defined(__x86_64__)
  if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "this machine has no fused multiply-add";
#endif
  if (!fuses_when_asked()) GTEST_SKIP() << "the compiler fuses nothing, and the test would show nothing";
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int i = 0; i < 100'000; ++i) {
    Pose pose;
    for (double& entry : pose.matrix) entry = number(random);
    const std::array<double, 3> x{number(random), number(random), number(random)};
    const std::array<double, 3> placed = pose.place(x.data());
    const std::array<double, 3> expected = place_by_operations(pose, x);
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_EQ(std::bit_cast<std::uint64_t>(placed[axis]), std::bit_cast<std::uint64_t>(expected[axis]));
  }
}

}  // namespace
}  // namespace warmfront
