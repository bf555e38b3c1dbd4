// SPDX-License-Identifier: Apache-2.0
#include "engine/step/kept_room.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace warmfront {
namespace {

class KeptRoomTest : public ::testing::Test {
 protected:
  double draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Corner draw_corner() { return {draw(-1, 1), draw(-1, 1), draw(-1, 1), 0}; }
  ChordBox draw_box() { return around_points(std::array{draw_corner(), draw_corner()}); }
  Corner draw_within(const ChordBox& box) {
    Corner x{};
    for (std::size_t k = 0; k < 3; ++k) x[k] = draw(box.low[k], box.high[k]);
    return x;
  }

  std::mt19937_64 random_{4};
};

double apart(const Corner& x, const Corner& y) {
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

TEST_F(KeptRoomTest, IsNoLessThanTheSeparationOfAnyPairWithin) {
  int less_than_most = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const KeepDistance keep{draw(0.05, 0.95), draw(0, 1)};
    const double widest = keep.beyond + draw(0, 2), besides = draw(0, 0.1);
    const KeptRoom room(keep, widest, besides, 0x1p-10);
    const ChordBox a = draw_box(), b = draw_box();
    less_than_most += room.of(a, b) < room.most() ? 1 : 0;
    for (int k = 0; k < 8; ++k) {
      const double d = apart(draw_within(a), draw_within(b));
      const double own =
          std::min(widest, d > keep.beyond ? keep.beyond + keep.share * (d - keep.beyond) : keep.beyond);
      ASSERT_GE(room.of(a, b), own + besides);
      ASSERT_LE(room.of(a, b), room.most());
    }
  }
  EXPECT_GT(less_than_most, 500);
}

TEST_F(KeptRoomTest, OfWhatHoldsMoreIsNoLess) {
  for (int trial = 0; trial < 2000; ++trial) {
    const KeptRoom room({draw(0.05, 0.95), draw(0, 0.1)}, 10, 0.01, 0x1p-10);
    const ChordBox a = draw_box(), b = draw_box();
    ChordBox more = a;
    add(more, draw_box());
    ASSERT_GE(room.of(more, b), room.of(a, b));
    ASSERT_GE(room.of(b, more), room.of(b, a));
  }
}

TEST_F(KeptRoomTest, OfWhatIsNotANumberIsThatOfAll) {
  const KeptRoom room({0.5, 0}, 1, 0, 0);
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(room.of({{none, 0, 0, 0}, {none, 1, 1, 0}}, {{0, 0, 0, 0}, {0, 0, 0, 0}}), room.most());
}

}  // namespace
}  // namespace warmfront
