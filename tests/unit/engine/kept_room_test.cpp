// SPDX-License-Identifier: Apache-2.0
#include "engine/step/kept_room.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/elementary/query.h"

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

// Of two triangles, for each of their pairs of features, as a test of them says how far apart these start.
TEST_F(KeptRoomTest, OfCornersIsNoLessThanTheSeparationOfAnyFeatures) {
  int less_than_of_boxes = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const KeepDistance keep{draw(0.05, 0.95), draw(0, 0.3)};
    const KeptRoom room(keep, 10, 0, 0);
    Corners f, g;
    for (Corner& corner : f) corner = draw_corner();
    for (Corner& corner : g) corner = draw_corner();
    const bool flat = trial % 4 == 0;
    if (flat)
      f[2] = trial % 8 == 0 ? f[1]
                            : Corner{2 * f[1][0] - f[0][0], 2 * f[1][1] - f[0][1], 2 * f[1][2] - f[0][2], 0};
    g[0][2] += trial % 3;
    std::vector<FeatureVertices> pairs;
    std::array<VertexMotion, 3> of_f, of_g;
    for (std::size_t i = 0; i < 3; ++i) {
      of_f[i] = {f[i], f[i]};
      of_g[i] = {g[i], g[i]};
    }
    for (std::size_t i = 0; i < 3; ++i) {
      pairs.push_back({ContactKind::kVertexFace, {&of_f[i], &of_g[0], &of_g[1], &of_g[2]}});
      pairs.push_back({ContactKind::kVertexFace, {&of_g[i], &of_f[0], &of_f[1], &of_f[2]}});
      for (std::size_t j = 0; j < 3; ++j)
        pairs.push_back(
            {ContactKind::kEdgeEdge, {&of_f[i], &of_f[(i + 1) % 3], &of_g[j], &of_g[(j + 1) % 3]}});
    }
    for (const FeatureVertices& pair : pairs) {
      const Query query = Query::prepare(pair, 0);
      const double d = query.unscaled(starts_apart(query, closest_direction(query, 0)));
      const double own = d > keep.beyond ? keep.beyond + keep.share * (d - keep.beyond) : keep.beyond;
      ASSERT_GE(room.of(f, g) * (1 + 0x1p-30) + 0x1p-40, own);
    }
    const double of_boxes = room.of(around_points(f), around_points(g));
    ASSERT_LE(room.of(f, g), of_boxes * (1 + 0x1p-30));
    less_than_of_boxes += room.of(f, g) < 0.9 * of_boxes ? 1 : 0;
  }
  EXPECT_GT(less_than_of_boxes, 1000);
}

TEST_F(KeptRoomTest, OfCornersThatAreNoNumbersIsThatOfAll) {
  const KeptRoom room({0.5, 0}, 1, 0, 0);
  const Corners some{{{0, 0, 0, 0}, {1, 0, 0, 0}, {0, 1, 0, 0}}};
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    EXPECT_EQ(room.of(some, Corners{{{odd, 0, 0, 0}, {1, 0, 5, 0}, {0, 1, 5, 0}}}), room.most());
  }
}

// Where squares of distances are too small to tell: corners have no more room than boxes around them, and
// these no less than what they hold, and none is too little.
TEST_F(KeptRoomTest, OfWhatIsTooSmallForSquaresIsEnough) {
  const KeptRoom room({0.5, 0}, 1, 0, 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const double scale = std::ldexp(1, -400 - trial % 680);
    Corners f, g, more;
    for (Corners* corners : {&f, &g, &more}) {
      for (Corner& corner : *corners) {
        corner = draw_corner();
        for (double& x : corner) x *= scale * (draw(0, 1) < 0.3 ? 0x1p-60 : 1);
      }
    }
    const ChordBox a = around_points(f), b = around_points(g);
    ChordBox holds = a;
    add(holds, around_points(more));
    const double nearest = std::hypot(f[0][0] - g[0][0], f[0][1] - g[0][1], f[0][2] - g[0][2]);
    const bool points = trial % 2 == 0;  // whose only features are as far apart as they
    if (points) {
      f[1] = f[2] = f[0];
      g[1] = g[2] = g[0];
      ASSERT_GE(room.of(f, g), std::min(1.0, 0.5 * nearest));
    }
    ASSERT_LE(room.of(f, g), room.of(a, b));
    ASSERT_LE(room.of(a, b), room.of(holds, b));
  }
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
