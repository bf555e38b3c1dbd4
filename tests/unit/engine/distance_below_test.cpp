// SPDX-License-Identifier: Apache-2.0
// Lower bounds of distances: never above the true distance, and close to it, by rational arithmetic.
#include "engine/elementary/distance_below.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/feature_case.h"

namespace warmfront {
namespace {

using Point = std::array<mpq_class, 3>;

Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
mpq_class dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The squared distance of 0 from the hull of some points: the best separating plane, over the nearest points
// to 0 of the spans of one, two or three points.
mpq_class exact_square(const std::vector<Point>& hull) {
  mpq_class most = 0;
  const auto look = [&](const Point& foot) {
    const mpq_class square = dot(foot, foot);
    if (square > most && std::ranges::all_of(hull, [&](const Point& p) { return dot(foot, p) >= square; }))
      most = square;
  };
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point& a = hull[i];
    look(a);
    for (std::size_t j = i + 1; j < hull.size(); ++j) {
      const Point ab = hull[j] - a;
      const mpq_class square = dot(ab, ab);
      if (square == 0) continue;
      const mpq_class s = dot(a, ab) / square;
      look({a[0] - s * ab[0], a[1] - s * ab[1], a[2] - s * ab[2]});
      for (std::size_t k = j + 1; k < hull.size(); ++k) {
        const Point n = cross(ab, hull[k] - a);
        const mpq_class area = dot(n, n);
        if (area == 0) continue;
        const mpq_class h = dot(a, n) / area;
        look({h * n[0], h * n[1], h * n[2]});
      }
    }
  }
  return most;
}

double exact_distance(const std::vector<Point>& hull) {
  return std::sqrt(exact_square(hull).get_d());
}

void add(const Vec3& p, std::vector<Point>& hull) {
  hull.push_back({mpq_class(p.x), mpq_class(p.y), mpq_class(p.z)});
}

// Thin, short, parallel, flat and fast ones, at distances from far to nearly nothing.
testing::FeatureCase draw(std::mt19937_64& random) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  const auto tiny = [&] { return std::ldexp(1.0, -static_cast<int>(random() % 50)); };
  const ContactKind kind = random() % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge;
  const int of_first = kind == ContactKind::kVertexFace ? 1 : 2;
  const double flat = random() % 2 == 0 ? 0 : tiny();
  const double thin = random() % 2 == 0 ? 1 : tiny();
  const double gap = std::ldexp(1.0 + uniform() / 2, -static_cast<int>(random() % 22));
  const double motion = random() % 3 == 0 ? 0 : tiny();
  const double turn = random() % 3 == 0 ? 0 : uniform();
  std::array<testing::Points, 2> x;
  for (int k = 0; k < 4; ++k) {
    const double side = k < of_first ? 0 : gap;
    x[0][k] = {uniform(), thin * uniform(), side + flat * uniform()};
    if (k == 3 && random() % 4 == 0) {  // parallel to the first edge, or in line with the two before
      for (int axis = 0; axis < 3; ++axis) x[0][k][axis] = x[0][2][axis] + x[0][1][axis] - x[0][0][axis];
    }
  }
  for (int k = 0; k < 4; ++k)
    for (int axis = 0; axis < 3; ++axis) x[1][k][axis] = x[0][k][axis] + motion * uniform();
  for (auto& end : x) {
    for (auto& p : end) {
      p = {std::cos(turn) * p[0] - std::sin(turn) * p[2], p[1],
           std::sin(turn) * p[0] + std::cos(turn) * p[2]};
      p = {p[0], std::cos(turn) * p[1] - std::sin(turn) * p[2],
           std::sin(turn) * p[1] + std::cos(turn) * p[2]};
    }
  }
  return {kind, x[0], x[1]};
}

TEST(DistanceBelow, IsWithinItsBoundOfTheExactDistance) {
  std::mt19937_64 random(5);
  int known = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    const testing::FeatureCase drawn = draw(random);
    const Query query = Query::prepare(drawn.features(), 0);
    std::vector<Point> at_start;
    std::vector<Point> swept;
    for (int k = 0; k < query.gap_count; ++k) {
      add(query.gaps[k].t0, at_start);
      add(query.gaps[k].t0, swept);
      add(query.gaps[k].t1, swept);
    }
    const auto check = [&](double below, double exact) {
      ASSERT_LE(below, exact) << trial;
      if (exact < 0x1p-20) return;
      ++known;
      ASSERT_GE(below, exact - 0x1p-23) << trial;
    };
    check(distance_below(query, 0), exact_distance(at_start));
    check(distance_below(query, Window{0, 1}), exact_distance(swept));
  }
  EXPECT_GT(known, 2'000);
}

TEST(DistanceBelow, OfWhatMeetsNothingIsKnown) {
  const testing::FeatureCase through(ContactKind::kVertexFace, testing::kTriangleBelow,
                                     testing::moved(testing::kTriangleBelow, 0, 0, 0, -2));
  const Query query = Query::prepare(through.features(), 0);
  EXPECT_LT(distance_below(query, 0.5), 0);
  EXPECT_LT(distance_below(query, Window{0, 1}), 0);
  EXPECT_GT(distance_below(query, Window{0, 0.25}), 0.2);
}

}  // namespace
}  // namespace warmfront
