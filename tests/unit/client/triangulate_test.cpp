// SPDX-License-Identifier: Apache-2.0
// Polygons become triangles that cover them once and nothing beside: area by area, point by point.
#include "client/io/triangulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "client/io/obj.h"
#include "client/io/ply.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

using Point = std::array<double, 2>;
using Face = std::array<std::int32_t, 3>;

/// The polygon as the only face, in a plane that is tilted by `tilt`.
Mesh polygon_of(const std::vector<Point>& corners, const std::array<double, 3>& tilt = {0, 0, 1}) {
  std::vector<double> positions;
  std::vector<std::int32_t> order;
  for (const auto& [x, y] : corners) {
    order.push_back(static_cast<std::int32_t>(order.size()));
    positions.insert(positions.end(), {tilt[1] * y + tilt[2] * x, tilt[2] * y, tilt[0] * x + tilt[1] * x});
  }
  Mesh mesh{std::move(positions), {}};
  append_face(order, 7, 3, mesh);
  return mesh;
}

double cross(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

bool inside(const std::vector<Point>& corners, const Point& p) {
  bool odd = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Point& a = corners[i];
    const Point& b = corners[j];
    if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0])
      odd = !odd;
  }
  return odd;
}

/// Every sample of the plane lies in as many triangles as polygons: one, or none; and none is turned over.
void expect_cover(const std::vector<Point>& corners, const Mesh& mesh, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> anywhere(-1.5, 1.5);
  ASSERT_EQ(mesh.faces.size(), corners.size() - 2);
  double around = 0;
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    around += cross(corners[0], corners[i], corners[i + 1]);
  for (int sample = 0; sample < 300; ++sample) {
    const Point p{anywhere(random), anywhere(random)};
    int count = 0;
    for (const Face& f : mesh.faces) {
      const Point &a = corners[f[0]], &b = corners[f[1]], &c = corners[f[2]];
      ASSERT_GE(cross(a, b, c) * around, -1e-12) << "seed " << seed << ": a triangle is turned over";
      const double u = cross(a, b, p), v = cross(b, c, p), w = cross(c, a, p);
      count += (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
    }
    ASSERT_EQ(count, inside(corners, p)) << "seed " << seed << " at " << p[0] << ", " << p[1];
  }
}

TEST(Triangulate, AConcavePolygonIsCutWithinItself) {
  // An arrowhead: the fan from either end covers the notch, where nothing is.
  const std::vector<Point> arrow{{1, -1}, {1, 1}, {-1, 1}, {0.25, 0.25}};
  for (std::size_t first = 0; first < 4; ++first) {
    std::vector<Point> corners = arrow;
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first), corners.end());
    Mesh mesh = polygon_of(corners);
    ASSERT_TRUE(triangulate(mesh, "m").ok());
    expect_cover(corners, mesh, first);
  }
}

TEST(Triangulate, ConvexPolygonsKeepTheirFans) {
  for (int n = 4; n < 40; n += 5) {
    std::vector<Point> corners;
    for (int k = 0; k < n; ++k)
      corners.push_back({std::cos(2 * std::numbers::pi * k / n), std::sin(2 * std::numbers::pi * k / n)});
    Mesh mesh = polygon_of(corners);
    const std::vector<Face> fan = mesh.faces;
    ASSERT_TRUE(triangulate(mesh, "m").ok());
    EXPECT_EQ(mesh.faces, fan) << n << " corners";
    expect_cover(corners, mesh, static_cast<std::uint64_t>(n));
  }
  // Corners along a side, the first of all and others.
  const std::vector<Point> corners{{0, -1}, {1, -1}, {1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, -1}};
  Mesh mesh = polygon_of(corners);
  const std::vector<Face> fan = mesh.faces;
  ASSERT_TRUE(triangulate(mesh, "m").ok());
  EXPECT_EQ(mesh.faces, fan);
  expect_cover(corners, mesh, 1);
}

// Stars with random spikes, turned either way, in planes of any direction.
TEST(Triangulate, RandomPolygonsAreCoveredOnce) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> radius(0.1, 1.4), any(-1, 1);
    const int n = 4 + static_cast<int>(random() % 40);
    std::vector<Point> corners;
    for (int k = 0; k < n; ++k) {
      const double angle = 2 * std::numbers::pi * k / n, r = radius(random);
      corners.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    if (seed % 2 == 1) std::ranges::reverse(corners);
    Mesh mesh = polygon_of(corners, {any(random), any(random), any(random)});
    ASSERT_TRUE(triangulate(mesh, "m").ok()) << seed;
    expect_cover(corners, mesh, seed);
  }
}

// On a grid most corners line up, and sides touch: predicates have to be exact.
TEST(Triangulate, CombsOnAGridAreCoveredOnce) {
  for (const int teeth : {2, 3, 9, 40}) {
    std::vector<Point> corners{{1, -1}, {-1, -1}};
    for (int t = 0; t < teeth; ++t) {
      const double left = -1 + 2.0 * t / teeth, width = 1.0 / teeth;
      corners.insert(corners.end(),
                     {{left, 0.75}, {left + width, 0.75}, {left + width, 0}, {left + 2 * width, 0}});
    }
    Mesh mesh = polygon_of(corners);
    ASSERT_TRUE(triangulate(mesh, "m").ok()) << teeth;
    expect_cover(corners, mesh, static_cast<std::uint64_t>(teeth));
  }
}

TEST(Triangulate, APolygonThatCrossesItselfIsRefusedByItsPlace) {
  Mesh bow_tie = polygon_of({{0, 0}, {1, 1}, {1, 0}, {-0.5, 1.5}});
  const Status status = triangulate(bow_tie, "m.obj");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().message,
            "m.obj: line 7: a polygon of 4 corners crosses itself; save it as triangles");
  Mesh even = polygon_of({{0, 0}, {1, 1}, {1, 0}, {0, 1}});
  even.polygons[0].line = 0;
  EXPECT_THAT(triangulate(even, "m.ply").error().message, HasSubstr("m.ply: face 3: a polygon of 4"));
  std::vector<Point> comb{{1, -1}};
  for (int k = 0; k < 2000; ++k) comb.push_back({1 - k * 1e-3, k % 2 == 0 ? 0.5 : 1});
  Mesh long_comb = polygon_of(comb);
  EXPECT_THAT(triangulate(long_comb, "m").error().message, HasSubstr("has more than 1024"));
}

TEST(Triangulate, SegmentsAndPointsAndWhatIsNotFiniteStayAsTheyAre) {
  for (const std::vector<Point>& corners :
       {std::vector<Point>{{0, 0}, {1, 1}, {0.5, 0.5}, {2, 2}}, std::vector<Point>(5, Point{1, 2}),
        std::vector<Point>{{0, 0}, {1, std::nan("")}, {0.5, 0.5}, {2, 2}}}) {
    Mesh mesh = polygon_of(corners);
    const std::vector<Face> fan = mesh.faces;
    EXPECT_TRUE(triangulate(mesh, "m").ok());
    EXPECT_EQ(mesh.faces, fan);
  }
}

// The exact predicates at both ends of double's range.
TEST(Triangulate, AnyScale) {
  for (const double scale : {0x1p-1070, 0x1p-600, 0x1p600, 0x1p1022}) {
    const std::vector<Point> corners{{1, -1}, {1, 1}, {-1, 1}, {0.25, 0.25}};
    Mesh mesh = polygon_of(corners);
    for (double& x : std::get<1>(mesh.positions)) x *= scale;
    ASSERT_TRUE(triangulate(mesh, "m").ok()) << scale;
    expect_cover(corners, mesh, 1);
  }
}

TEST(Triangulate, PolygonsOfFilesSayWhereTheyStand) {
  Result<Mesh> ascii = parse_ply(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 1 0\n1 0 0\n-.5 1.5 0\n3 0 1 2\n4 0 1 2 3\n",
      "m.ply");
  ASSERT_TRUE(ascii.ok()) << ascii.error().message;
  EXPECT_THAT(triangulate(ascii.value(), "m.ply").error().message, HasSubstr("m.ply: line 15: a polygon"));
}

}  // namespace
}  // namespace warmfront::client
