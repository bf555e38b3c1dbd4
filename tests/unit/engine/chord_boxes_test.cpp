// SPDX-License-Identifier: Apache-2.0
#include "engine/step/chord_boxes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "engine/elementary/turning_search.h"

namespace warmfront {
namespace {

class ChordBoxes : public ::testing::Test {
 protected:
  double draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Corner draw_corner() { return {draw(-1, 1), draw(-1, 1), draw(-1, 1), 0}; }

  std::mt19937_64 random_{3};
};

std::vector<Corner> at_times(FaceTimes face, std::vector<int> vertices, std::size_t k) {
  std::vector<Corner> points;
  for (const int v : vertices) points.insert(points.end(), {face[k][v], face[k + 1][v]});
  return points;
}

// Along x, y, z, and the sums and differences of two of them.
double along(std::size_t axis, const Corner& x) {
  if (axis < 3) return x[axis];
  const double other = x[(axis + 1) % 3];
  return axis < 6 ? x[axis % 3] + other : x[axis % 3] - other;
}

bool are_near(const std::vector<Corner>& a, const std::vector<Corner>& b, double room) {
  for (std::size_t axis = 0; axis < 9; ++axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least, other_least = least,
           other_most = most;
    for (const Corner& x : a) {
      least = std::min(least, along(axis, x));
      most = std::max(most, along(axis, x));
    }
    for (const Corner& x : b) {
      other_least = std::min(other_least, along(axis, x));
      other_most = std::max(other_most, along(axis, x));
    }
    const double wide = axis < 3 ? room : kDiagonal * room;
    if (least - other_most > wide || other_least - most > wide) return false;
  }
  return true;
}

// As near_features() is described, feature by feature.
std::uint32_t one_by_one(FaceTimes f, FaceTimes g, double room) {
  std::uint32_t near = 0;
  for (std::size_t k = 0; k + 1 < f.size(); ++k) {
    for (int i = 0; i < 3; ++i) {
      near |= std::uint32_t{are_near(at_times(f, {i}, k), at_times(g, {0, 1, 2}, k), room)} << i;
      near |= std::uint32_t{are_near(at_times(g, {i}, k), at_times(f, {0, 1, 2}, k), room)} << (3 + i);
      for (int j = 0; j < 3; ++j)
        near |=
            std::uint32_t{are_near(at_times(f, {i, (i + 1) % 3}, k), at_times(g, {j, (j + 1) % 3}, k), room)}
            << (6 + 3 * i + j);
    }
  }
  return near;
}

TEST_F(ChordBoxes, FeaturesAreNearWhereTheirBoxesAre) {
  std::vector<std::uint32_t> seen(16, 0);
  for (int trial = 0; trial < 5000; ++trial) {
    const auto times = static_cast<std::size_t>(2 + trial % 5);
    std::vector<std::array<Corner, 3>> f(times), g(times);
    for (std::size_t k = 0; k < times; ++k)
      for (int i = 0; i < 3; ++i) {
        f[k][i] = draw_corner();
        g[k][i] = draw_corner();
        g[k][i][0] += 1.5;
      }
    const double room = draw(0, 0.2);
    const std::uint32_t near = near_features(f, g, room);
    ASSERT_EQ(near, one_by_one(f, g, room)) << "trial " << trial;
    for (int bit = 0; bit < 15; ++bit) seen[static_cast<std::size_t>(bit)] += near >> bit & 1;
  }
  for (int bit = 0; bit < 15; ++bit) {
    EXPECT_GT(seen[static_cast<std::size_t>(bit)], 500U) << bit;
    EXPECT_LT(seen[static_cast<std::size_t>(bit)], 4900U) << bit;
  }
}

TEST_F(ChordBoxes, WhatIsNoNumberIsNear) {
  std::vector<std::array<Corner, 3>> f(2), g(2);
  for (auto& corners : g) corners.fill({9, 9, 9, 0});
  EXPECT_EQ(near_features(f, g, 1), 0U);
  const double none = std::numeric_limits<double>::quiet_NaN();
  for (auto& corners : g) corners.fill({none, none, none, 0});
  EXPECT_EQ(near_features(f, g, 1), (1U << 15) - 1);
}

TEST_F(ChordBoxes, PathsAreThoseOfTheElementaryTests) {
  for (int trial = 0; trial < 200; ++trial) {
    const double angle = draw(0, std::numbers::pi);
    Pose to;
    to.matrix = {
        std::cos(angle), -std::sin(angle), 0, 0.3, std::sin(angle), std::cos(angle), 0, -1, 0, 0, 1, 2};
    const Twist twist = twist_between(Pose(), to);
    const Corner x = draw_corner();
    VertexMotion vertex{x, {}};
    for (std::size_t row = 0; row < 3; ++row)
      vertex.t1[row] = to.matrix[4 * row] * x[0] + to.matrix[4 * row + 1] * x[1] +
                       to.matrix[4 * row + 2] * x[2] + to.matrix[4 * row + 3];
    const turning::Path path(vertex, &twist, {});
    std::vector<ArcTime> times;
    for (int k = 0; k < 8; ++k) times.push_back({k / 8.0, arc_shares(twist, k / 8.0)});
    const auto corner = [](const std::array<double, 3>& v) { return Corner{v[0], v[1], v[2], 0}; };
    std::vector<Corner> at(8 * 2);
    along_arc({corner(path.start), corner(path.way), corner(path.bend), corner(path.turn)}, times, at.data(),
              2);
    for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(at[2 * k], path.at(times[k].time, times[k].shares));
  }
}

}  // namespace
}  // namespace warmfront
