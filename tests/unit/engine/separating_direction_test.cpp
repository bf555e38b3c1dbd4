// SPDX-License-Identifier: Apache-2.0
// Parts' vertices side by side, their bounds, and directions between two parts.
#include "engine/broad_phase/separating_direction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "engine/bounds/moving.h"
#include "engine/bounds/overlap.h"
#include "tests/support/draws.h"

namespace warmfront {
namespace {

using Vector = std::array<double, 3>;

std::vector<VertexMotion> box(const Vector& at0, const Vector& at1, const Vector& half, double angle = 0) {
  std::vector<VertexMotion> box;
  for (int corner = 0; corner < 8; ++corner) {
    Vector x;
    for (int k = 0; k < 3; ++k) x[k] = (corner >> k & 1) != 0 ? half[k] : -half[k];
    const Vector turned{std::cos(angle) * x[0] - std::sin(angle) * x[1],
                        std::sin(angle) * x[0] + std::cos(angle) * x[1], x[2]};
    box.push_back({{at0[0] + x[0], at0[1] + x[1], at0[2] + x[2], 0},
                   {at1[0] + turned[0], at1[1] + turned[1], at1[2] + turned[2], 0}});
  }
  return box;
}

MovingPoints points_of(const std::vector<VertexMotion>& vertices, const LocalTransform& frame = {}) {
  MovingPoints points;
  points.take(vertices, frame);
  return points;
}

/// By how much b lies beyond a along a direction, at the worse end, in long doubles.
long double gap_along(const Vector& direction, const std::vector<VertexMotion>& a,
                      const std::vector<VertexMotion>& b) {
  long double least = std::numeric_limits<long double>::infinity();
  for (const auto end : {&VertexMotion::t0, &VertexMotion::t1}) {
    for (const VertexMotion& p : a) {
      for (const VertexMotion& q : b) {
        long double sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
          sum += static_cast<long double>(direction[k]) *
                 (static_cast<long double>((q.*end)[k]) - static_cast<long double>((p.*end)[k]));
        least = std::min(least, sum);
      }
    }
  }
  return least;
}

TEST(SeparatingDirection, FindsTheFaceBetweenABallsPlaceAndAWideFloor) {
  const auto floor = box({0, 0, -1}, {0, 0, -1}, {100, 80, 1});
  const auto ball = box({60, -50, 0.52}, {61, -50, 0.51}, {0.5, 0.5, 0.5});
  const auto direction = separating_direction(points_of(floor), points_of(ball), {}, {});
  ASSERT_TRUE(direction);
  EXPECT_GT(gap_along(*direction, floor, ball), 0.0L);
  const auto back = separating_direction(points_of(ball), points_of(floor), {}, {});
  ASSERT_TRUE(back);
  EXPECT_GT(gap_along(*back, ball, floor), 0.0L);
}

TEST(SeparatingDirection, ThereIsNoneWherePartsMeetWithinTheStepOnly) {
  // Past each other, with the same distance at both ends.
  const auto a = box({0, 0, 0}, {0, 0, 0}, {1, 1, 1});
  const auto b = box({-5, 0, 0}, {5, 0, 0}, {1, 1, 1});
  EXPECT_FALSE(separating_direction(points_of(a), points_of(b), {}, {}));
}

TEST(SeparatingDirection, ThereIsNoneWherePartsTouch) {
  const auto a = box({0, 0, 0}, {0, 0, 0}, {1, 1, 1});
  EXPECT_FALSE(
      separating_direction(points_of(a), points_of(box({2, 0.3, 0.1}, {2, 0, 0}, {1, 1, 1})), {}, {}));
  EXPECT_FALSE(separating_direction(points_of(a), points_of(a), {}, {})) << "centres in one place";
}

TEST(SeparatingDirection, ThereIsNoneForAPartWithinAHollowOne) {
  std::vector<VertexMotion> ring;
  for (int i = 0; i < 12; ++i) {
    const Vector x{4 * std::cos(i), 4 * std::sin(i), 0};
    ring.push_back({{x[0], x[1], 0, 0}, {x[0], x[1], 0, 0}});
  }
  EXPECT_FALSE(
      separating_direction(points_of(ring), points_of(box({0, 0, 0}, {0, 0, 0}, {1, 1, 1})), {}, {}));
}

TEST(SeparatingDirection, PartsAreApartHoweverFarTheyMove) {
  const auto a = box({0, 0, 0}, {500, 0, 0}, {1, 1, 1});
  const auto b = box({0, 2.1, 0}, {500, 2.1, 0}, {1, 1, 1});
  EXPECT_TRUE(separating_direction(points_of(a), points_of(b), {}, {.share_of_size = 1.0 / 64}));
  const auto c = box({-300, 2.1, 0}, {200, 2.1, 0}, {1, 1, 1});  // past the first one
  EXPECT_TRUE(separating_direction(points_of(box({0, 0, 0}, {0, 0, 0}, {1, 1, 1})), points_of(c), {},
                                   {.share_of_size = 1.0 / 4096}));
}

TEST(SeparatingDirection, TheGapMustBeAsWideAsIsWanted) {
  const auto a = points_of(box({0, 0, 0}, {0, 0, 0}, {1, 1, 1}));
  const auto b = points_of(box({2.5, 0, 0}, {2.5, 0, 0}, {1, 1, 1}));
  EXPECT_TRUE(separating_direction(a, b, {}, {.least = 0.499}));
  EXPECT_FALSE(separating_direction(a, b, {}, {.least = 0.501}));
  EXPECT_TRUE(separating_direction(a, b, {}, {.share_of_size = 0.05}));
  EXPECT_FALSE(separating_direction(a, b, {}, {.share_of_size = 0.2}));
}

TEST(SeparatingDirection, StartsFromWhatWasFoundBefore) {
  const auto a = points_of(box({0, 0, 0}, {0, 0, 0}, {1, 1, 1}));
  const auto b = points_of(box({2.5, 0, 0}, {2.5, 0, 0}, {1, 1, 1}));
  const Vector before{std::sqrt(0.99), 0.1, 0};
  EXPECT_EQ(separating_direction(a, b, {}, {}, before), before);
  EXPECT_TRUE(separating_direction(a, b, {}, {}, Vector{-1, 0, 0})) << "one that does not serve any more";
}

// Multiplied by a matrix with zeros, infinite float32 values would become NaN, which no maximum contains.
TEST(SeparatingDirection, APosedPartBeyondFloatsRangeIsNeverTakenForApart) {
  const std::vector<double> rest{0, 0, 0, 1e60, 0, 0, 0, 1, 0};
  MovingPoints huge;
  huge.take(RestPoints(rest, {0, 0, 0}, {}), Pose{}, Pose{}, {});
  EXPECT_FALSE(separating_direction(huge, points_of(box({1e3, 5, 0}, {1e3, 5, 0}, {1, 1, 1})), {}, {}));
}

TEST(SeparatingDirection, CoordinatesBeyondFloatsRangeAreNeverTakenForApart) {
  constexpr double kHuge = 1e200;
  const auto a = points_of(box({0, 0, 0}, {0, 0, 0}, {kHuge, kHuge, kHuge}));
  const auto b = points_of(box({5 * kHuge, 0, 0}, {5 * kHuge, 0, 0}, {kHuge, kHuge, kHuge}));
  EXPECT_FALSE(separating_direction(a, b, {}, {}));
  const LocalTransform frame{{}, 0x1p-600, 0x1p-60};  // which scenes of such a size have
  EXPECT_TRUE(separating_direction(
      points_of(box({0, 0, 0}, {0, 0, 0}, {kHuge, kHuge, kHuge}), frame),
      points_of(box({5 * kHuge, 0, 0}, {5 * kHuge, 0, 0}, {kHuge, kHuge, kHuge}), frame), frame, {}));
}

// Found by fuzz_session: bodies of size 1 in a scene of size 1e112 were taken for points.
TEST(SeparatingDirection, SpecksBesideTheirFrameAreNeverTakenForApart) {
  const auto a = box({0, 0, 0}, {0, 0, 0}, {1, 1, 1});
  const auto b = box({0.5, 0, 0.4}, {0.5, 0, 1.4}, {1, 1, 1});
  for (const double scale : {0x1p-40, 0x1p-70, 0x1p-100, 0x1p-140, 0x1p-160, 0x1p-400, 0x1p-1000}) {
    const LocalTransform frame{{}, scale, 1};
    const MovingPoints points = points_of(a, frame);
    EXPECT_GE(points.radius(), 1.7 * scale);
    EXPECT_FALSE(separating_direction(points, points_of(b, frame), frame, {})) << scale;
  }
}

class RandomParts : public testing::Draws {
 public:
  using Draws::Draws;

  Vector vector(double scale) { return {uniform(scale), uniform(scale), uniform(scale)}; }

  /// From 1 to 40 points about a centre, each with its own motion.
  std::vector<VertexMotion> part(const Vector& centre, double size, double motion) {
    std::vector<VertexMotion> part(static_cast<std::size_t>(1 + below(40)));
    const Vector drift = vector(motion);
    for (VertexMotion& vertex : part) {
      const Vector x = vector(size);
      const Vector own = vector(0.3 * motion);
      for (std::size_t k = 0; k < 3; ++k) {
        vertex.t0[k] = centre[k] + x[k];
        vertex.t1[k] = vertex.t0[k] + drift[k] + own[k];
      }
      vertex.t0[3] = vertex.t1[3] = 0;
    }
    return part;
  }
};

TEST(SeparatingDirection, WhatIsFoundSeparatesAndWhatIsWellApartIsFound) {
  std::size_t found = 0;
  std::size_t missed = 0;
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    RandomParts random(seed);
    const double scale = std::pow(10.0, random.below(13) - 6);
    const Vector offset = random.vector(random.below(2) == 0 ? 0 : 1e4 * scale);
    const auto a = random.part(offset, scale, 0.3 * scale);
    Vector centre = random.vector(2.5 * scale);
    for (std::size_t k = 0; k < 3; ++k) centre[k] += offset[k];
    const auto b = random.part(centre, scale * std::pow(10.0, random.uniform(1)), 0.3 * scale);
    // Now and then a frame that was made for something far larger, or smaller.
    const int off = random.below(4) == 0 ? random.below(400) - 300 : 0;
    const LocalTransform frame{offset, std::exp2(off - std::round(std::log2(scale))), 1};
    const double least = random.below(2) == 0 ? 0 : std::fabs(random.uniform(0.2 * scale));
    const auto direction = separating_direction(points_of(a, frame), points_of(b, frame), frame,
                                                {.least = frame.to_local(least)});
    if (direction) {
      ++found;
      EXPECT_GT(gap_along(*direction, a, b), static_cast<long double>(least)) << seed;
      EXPECT_NEAR(std::hypot((*direction)[0], (*direction)[1], (*direction)[2]), 1, 1e-12);
    } else if (off == 0) {
      // Some direction of many would have done by far.
      for (int i = 0; i < 100; ++i) {
        Vector d = random.vector(1);
        const double length = std::hypot(d[0], d[1], d[2]);
        for (double& x : d) x /= length;
        missed += gap_along(d, a, b) > static_cast<long double>(least + 0.05 * scale);
      }
    }
  }
  EXPECT_GT(found, 5'000U);
  EXPECT_EQ(missed, 0U);
}

TEST(MovingPoints, PosedOnesAreThoseThatThePosePlaces) {
  RandomParts random(7);
  for (int round = 0; round < 200; ++round) {
    const Vector offset = random.vector(round % 2 == 0 ? 1 : 1e5);
    std::vector<double> rest;
    const int count = 1 + random.below(30);
    for (int i = 0; i < count; ++i) {
      for (const double o : offset) rest.push_back(o + random.uniform(1));
    }
    const auto pose = [&](double turn) {
      Pose pose;
      pose.matrix[0] = pose.matrix[5] = std::cos(turn);
      pose.matrix[1] = -std::sin(turn);
      pose.matrix[4] = std::sin(turn);
      for (int row = 0; row < 3; ++row) pose.matrix[4 * row + 3] = random.uniform(2);
      return pose;
    };
    const std::array<Pose, 2> poses{pose(random.uniform(3)), pose(random.uniform(3))};
    const LocalTransform frame{offset, 0.5, 0.5};
    const RestPoints points(rest, offset, frame);
    MovingPoints moving;
    moving.take(points, poses[0], poses[1], frame);
    ASSERT_EQ(moving.count(), static_cast<std::uint32_t>((count + 7) / 8 * 8));
    for (int end = 0; end < 2; ++end) {
      for (std::uint32_t i = 0; i < moving.count(); ++i) {
        const std::size_t of = std::min<std::size_t>(i, static_cast<std::size_t>(count) - 1);
        const Vector x = poses[end].place(rest.data() + 3 * of);
        Vector from_centre;
        for (int k = 0; k < 3; ++k) {
          from_centre[k] = frame.to_local(x[k] - moving.centre(end)[k]);
          EXPECT_NEAR(moving.lane(end, k)[i], from_centre[k], 0x1p-21 * moving.radius() + moving.blur());
        }
        EXPECT_LE(std::hypot(from_centre[0], from_centre[1], from_centre[2]),
                  moving.radius() + moving.blur());
      }
    }
  }
}

// The vertices' own bounds reject every pair that these bounds reject.
TEST(MovingPoints, TheirBoundsHoldThoseOfTheVertices) {
  for (std::uint64_t seed = 0; seed < 2'000; ++seed) {
    RandomParts random(seed);
    const double scale = std::pow(10.0, random.below(9) - 6);
    const Vector offset = random.vector(random.below(2) == 0 ? 0 : 1e6);
    const auto part = random.part(offset, scale, scale);
    const LocalTransform frame{random.below(2) == 0 ? offset : Vector{}, 1, 1};
    double magnitude = 0x1p-30;
    const double separation = random.below(2) == 0 ? 0 : 0.1 * scale;
    for (const VertexMotion& vertex : part) {
      for (std::size_t k = 0; k < 3; ++k)
        for (const double x : {vertex.t0[k], vertex.t1[k]})
          magnitude = std::max({magnitude, std::fabs(x - frame.origin[k]), separation});
    }
    magnitude = std::exp2(std::ceil(std::log2(magnitude)));
    const KDop18 whole = moving_bounds(points_of(part, frame), frame, separation, magnitude);
    for (const VertexMotion& vertex : part) {
      const KDop18 inner = moving_bounds(vertex, frame, separation, magnitude);
      for (std::size_t k = 0; k < whole.lane.size(); ++k) ASSERT_LE(whole.lane[k], inner.lane[k]) << seed;
    }
    // And they are not much larger.
    KDop18 merged = moving_bounds(part[0], frame, separation, magnitude);
    for (const VertexMotion& vertex : part) merged.merge(moving_bounds(vertex, frame, separation, magnitude));
    for (std::size_t k = 0; k < whole.lane.size(); ++k)
      ASSERT_GE(whole.lane[k], static_cast<double>(merged.lane[k]) - 1e-4 * scale - 0x1p-20 * magnitude)
          << seed;
  }
}

}  // namespace
}  // namespace warmfront
