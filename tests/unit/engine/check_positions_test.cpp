// SPDX-License-Identifier: Apache-2.0
// Positions are checked by several threads where they are many, and the answer is the same.
#include "engine/motion/check_positions.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfenv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "tests/support/workers.h"

namespace warmfront {
namespace {

template <class Real>
void names_the_first() {
  constexpr std::uint32_t kVertices = 40000;
  std::vector<Real> positions(std::size_t{3} * kVertices, Real(0.5));
  const auto check = [&](Workers* workers) {
    return check_positions(std::span<const Real>(positions), kVertices, "positions", {}, workers);
  };
  for (Workers* workers : {static_cast<Workers*>(nullptr), testing::workers().get()}) {
    positions[3 * 39999 + 2] = positions[3 * 21000 + 1] = Real(0.5);
    EXPECT_TRUE(check(workers).ok());
    positions[3 * 39999 + 2] = std::numeric_limits<Real>::infinity();
    ASSERT_FALSE(check(workers).ok());
    EXPECT_EQ(check(workers).error().message, "positions[39999].z: is infinite; coordinates must be finite");
    positions[3 * 21000 + 1] = std::numeric_limits<Real>::quiet_NaN();
    ASSERT_FALSE(check(workers).ok());
    EXPECT_EQ(check(workers).error().message,
              "positions[21000].y: is not a number; coordinates must be finite");
    const std::atomic<bool> stop{true};
    EXPECT_THROW(static_cast<void>(check_positions(std::span<const Real>(positions), kVertices, "positions",
                                                   StopSignal(&stop), workers)),
                 Stopped);
  }
}

TEST(CheckPositions, NamesTheFirstOfMany) {
  names_the_first<float>();
  names_the_first<double>();
}

// A program that debugs may have the processor trap where something is not a number.
TEST(CheckPositions, NothingTraps) {
  const std::vector<double> positions{0, 1, std::numeric_limits<double>::infinity()};
  std::fenv_t saved;
  std::fegetenv(&saved);
  feenableexcept(FE_INVALID | FE_OVERFLOW | FE_DIVBYZERO);
  const Status status = check_positions(std::span<const double>(positions), 1, "positions", {}, nullptr);
  const int traps = fegetexcept();
  std::fesetenv(&saved);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message, "positions[0].z: is infinite; coordinates must be finite");
  EXPECT_EQ(traps, FE_INVALID | FE_OVERFLOW | FE_DIVBYZERO);
}

}  // namespace
}  // namespace warmfront
