// SPDX-License-Identifier: Apache-2.0
// Ear clipping: see triangulate.h.
//
// The triangles cover exactly the polygon whichever ears are cut: cutting one keeps the sum of the
// boundaries, so the number of triangles over a point is the polygon's winding number there, provided that no
// triangle is reversed. Ears are therefore only corners that turn left or not at all, by exact predicates;
// the check for corners within an ear only ensures that the remaining ears can be cut.
#include "client/io/triangulate.h"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "client/io/text.h"

namespace warmfront::client {
namespace {

// Ear clipping takes up to the cube of the corners.
constexpr std::size_t kMostCorners = 1024;

struct Point {
  double x, y;
  friend bool operator==(const Point&, const Point&) = default;
};

/// The sign of the area of (a, b, c): 1 where it turns left. Exact.
int orientation(const Point& a, const Point& b, const Point& c) {
  const double left = (b.x - a.x) * (c.y - a.y);
  const double right = (b.y - a.y) * (c.x - a.x);
  const double area = left - right;
  // Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates",
  // orient2d; above what underflow could add, and below what overflows.
  const double bound = 0x1.8p-52 * 2 * (std::fabs(left) + std::fabs(right)) + 0x1p-1000;
  if (std::isfinite(bound) && std::fabs(area) > bound) return area > 0 ? 1 : -1;
  const mpq_class ax(a.x), ay(a.y);
  return sgn((mpq_class(b.x) - ax) * (mpq_class(c.y) - ay) - (mpq_class(b.y) - ay) * (mpq_class(c.x) - ax));
}

/// Whether p lies in the closed triangle (a, b, c), which turns left.
bool holds(const Point& a, const Point& b, const Point& c, const Point& p) {
  return orientation(a, b, p) >= 0 && orientation(b, c, p) >= 0 && orientation(c, a, p) >= 0;
}

using Corner = std::array<double, 3>;

/// The corners in the coordinate plane that the polygon faces most, where it turns left: by Newell's normal.
/// Nothing when a coordinate is not finite.
std::optional<std::vector<Point>> project(const std::vector<Corner>& corners) {
  double scale = 0;
  for (const Corner& corner : corners)
    for (const double x : corner) scale = std::max(scale, std::fabs(x));
  for (const Corner& corner : corners)
    if (!std::ranges::all_of(corner, [](double x) { return std::isfinite(x); })) return std::nullopt;
  std::array<double, 3> normal{};
  const auto scaled = [&](std::size_t i, int axis) {
    return scale == 0 ? 0 : corners[i][axis] / scale - corners[0][axis] / scale;
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::size_t j = (i + 1) % corners.size();
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      normal[axis] += (scaled(i, u) - scaled(j, u)) * (scaled(i, v) + scaled(j, v));
    }
  }
  const auto most = std::ranges::max_element(normal, {}, [](double n) { return std::fabs(n); });
  const int axis = static_cast<int>(most - normal.begin());
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<Point> points;
  for (const Corner& corner : corners)
    points.push_back(*most < 0 ? Point{corner[v], corner[u]} : Point{corner[u], corner[v]});
  return points;
}

/// Whether the polygon never turns right and goes around once: then its fan is itself.
bool is_convex(const std::vector<Point>& points) {
  const std::size_t n = points.size();
  int direction = 0, turns_back = 0, first_direction = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Point& a = points[i];
    const Point& b = points[(i + 1) % n];
    if (orientation(a, b, points[(i + 2) % n]) < 0) return false;
    if (a == b) continue;
    const int now = b.x > a.x || (b.x == a.x && b.y > a.y) ? 1 : -1;
    if (direction == 0) first_direction = now;
    if (direction != 0 && now != direction) ++turns_back;
    direction = now;
  }
  if (direction != first_direction) ++turns_back;
  return turns_back <= 2;
}

bool is_collinear(const std::vector<Corner>& corners) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto flat = [&](const Corner& c) { return Point{c[axis], c[(axis + 1) % 3]}; };
    const auto other = std::ranges::find_if(corners, [&](const Corner& c) { return c != corners[0]; });
    if (other == corners.end()) return true;
    for (const Corner& c : corners)
      if (orientation(flat(corners[0]), flat(*other), flat(c)) != 0) return false;
  }
  return true;
}

/// Three corners a triangle, by their places in `points`; nothing when no ear is left.
std::optional<std::vector<std::array<std::size_t, 3>>> clip_ears(const std::vector<Point>& points) {
  std::vector<std::size_t> left(points.size());
  std::iota(left.begin(), left.end(), std::size_t{0});
  std::vector<std::array<std::size_t, 3>> ears;
  bool any_area = false;
  const auto ear_at = [&](std::size_t i) {
    return std::array{left[(i + left.size() - 1) % left.size()], left[i], left[(i + 1) % left.size()]};
  };
  const auto is_free = [&](const std::array<std::size_t, 3>& ear) {
    const Point& a = points[ear[0]];
    const Point& b = points[ear[1]];
    const Point& c = points[ear[2]];
    return std::ranges::none_of(left, [&](std::size_t k) {
      const Point& p = points[k];
      return p != a && p != b && p != c && holds(a, b, c, p);
    });
  };
  while (left.size() > 3) {
    std::optional<std::size_t> found, flat;
    for (std::size_t i = 0; i < left.size() && !found; ++i) {
      const auto ear = ear_at(i);
      const int turn = orientation(points[ear[0]], points[ear[1]], points[ear[2]]);
      if (turn == 0 && !flat) flat = i;
      if (turn > 0 && is_free(ear)) found = i;
    }
    any_area |= found.has_value();
    if (!found) found = flat;
    if (!found) return std::nullopt;
    ears.push_back(ear_at(*found));
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(*found));
  }
  ears.push_back({left[0], left[1], left[2]});
  const int last = orientation(points[left[0]], points[left[1]], points[left[2]]);
  // Flat in this plane but not degenerate: it winds back and forth.
  if (last < 0 || (last == 0 && !any_area)) return std::nullopt;
  return ears;
}

Status refuse(const Polygon& polygon, std::string_view file, const std::string& what) {
  const std::string place =
      polygon.line > 0 ? "line " + std::to_string(polygon.line) : "face " + std::to_string(polygon.number);
  return invalid_argument(std::string(file) + ": " + place + ": a polygon of " +
                          std::to_string(polygon.corners) + " corners " + what);
}

}  // namespace

Status triangulate(Mesh& mesh, std::string_view file) {
  const Positions positions = view(mesh.positions);
  for (const Polygon& polygon : mesh.polygons) {
    const auto first = mesh.faces.begin() + static_cast<std::ptrdiff_t>(polygon.first_face);
    std::vector<std::int32_t> vertices{(*first)[0], (*first)[1]};
    for (std::size_t k = 0; k + 2 < polygon.corners; ++k)
      vertices.push_back(first[static_cast<std::ptrdiff_t>(k)][2]);
    std::vector<Corner> corners;
    for (const std::int32_t v : vertices) {
      const std::size_t at = 3 * static_cast<std::size_t>(v);
      corners.push_back(
          {coordinate(positions, at), coordinate(positions, at + 1), coordinate(positions, at + 2)});
    }
    const std::optional<std::vector<Point>> points = project(corners);
    if (!points || is_convex(*points) || is_collinear(corners)) continue;
    if (corners.size() > kMostCorners)
      return refuse(
          polygon, file,
          "is concave, and has more than " + std::to_string(kMostCorners) + "; save it as triangles");
    const auto ears = clip_ears(*points);
    if (!ears) return refuse(polygon, file, "crosses itself; save it as triangles");
    for (std::size_t k = 0; k < ears->size(); ++k)
      for (std::size_t corner = 0; corner < 3; ++corner)
        first[static_cast<std::ptrdiff_t>(k)][corner] = vertices[(*ears)[k][corner]];
  }
  return {};
}

}  // namespace warmfront::client
