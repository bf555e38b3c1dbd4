// SPDX-License-Identifier: Apache-2.0
// Pairs of moving triangles, drawn for the tests of the filter of eight of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <random>
#include <vector>

#include "engine/bounds/moving.h"
#include "engine/bounds/width.h"
#include "engine/elementary/query.h"
#include "engine/motion/motion.h"
#include "engine/narrow_phase/triangle_filter.h"
#include "tests/support/brute_force.h"

namespace warmfront::testing {

using Triangles = std::array<std::array<double, 3>, 6>;  // the first one's corners, the second one's

struct MovingTriangles {
  Triangles t0;
  Triangles t1;
};

inline constexpr std::size_t kEight = 8;

inline std::vector<VertexMotion> vertices_of(const MovingTriangles& pair) {
  std::vector<VertexMotion> vertices(6);
  for (std::size_t k = 0; k < 6; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      vertices[k].t0[axis] = pair.t0[k][axis];
      vertices[k].t1[axis] = pair.t1[k][axis];
    }
  }
  return vertices;
}

/// What the filter is asked about, of eight pairs.
struct EightPairs {
  EightTrianglePairs pairs;
  std::vector<PointBounds> points;
};

inline EightPairs eight_pairs(const std::array<MovingTriangles, kEight>& pairs, double separation) {
  std::vector<double> positions;
  std::vector<VertexMotion> vertices;
  for (const MovingTriangles& pair : pairs) {
    for (const auto& corner : pair.t0) positions.insert(positions.end(), corner.begin(), corner.end());
    std::ranges::copy(vertices_of(pair), std::back_inserter(vertices));
  }
  const LocalTransform frame = Motion(positions).frame();
  const double magnitude = least_magnitude(vertices, frame, separation);
  EightPairs eight;
  for (std::uint32_t p = 0; p < vertices.size(); ++p) {
    eight.pairs.vertex[p % 6][p / 6] = p;
    eight.points.push_back(point_bounds(vertices[p], frame, magnitude));
  }
  eight.pairs.width.fill(Width::of(frame.to_local(separation)).straight);
  return eight;
}

/// Does any of the fifteen pairs of features?
template <class Contact>
bool any_contact(const MovingTriangles& pair, Contact&& contact) {
  const auto v = vertices_of(pair);
  const auto of = [&](ContactKind kind, int a, int b, int c, int d) {
    return contact(FeatureVertices{kind, {&v[a], &v[b], &v[c], &v[d]}});
  };
  for (int i = 0; i < 3; ++i) {
    if (of(ContactKind::kVertexFace, i, 3, 4, 5) || of(ContactKind::kVertexFace, 3 + i, 0, 1, 2)) return true;
    for (int j = 0; j < 3; ++j)
      if (of(ContactKind::kEdgeEdge, i, (i + 1) % 3, 3 + j, 3 + (j + 1) % 3)) return true;
  }
  return false;
}

// Multiples of 2^-20 in [-1, 1].
inline double on_grid(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(std::uniform_int_distribution<int>(-(1 << 20), 1 << 20)(random)),
                    -20);
}

// Two triangles side by side, each moving as a whole, fast or slow, and each corner on its own as well.
inline MovingTriangles near_each_other(std::mt19937_64& random) {
  MovingTriangles pair;
  const double speed = std::ldexp(1.0, -static_cast<int>(random() % 8));
  const double turn = std::ldexp(1.0, -static_cast<int>(random() % 8) - 2);
  const double beside = std::ldexp(1.0, -static_cast<int>(random() % 4));
  for (std::size_t triangle = 0; triangle < 2; ++triangle) {
    const std::array<double, 3> way{speed * on_grid(random), speed * on_grid(random),
                                    speed * on_grid(random)};
    for (std::size_t k = 3 * triangle; k < 3 * triangle + 3; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        pair.t0[k][axis] =
            (axis == 2 ? 0.25 : 1) * on_grid(random) + (axis == 2 && triangle == 1 ? beside : 0);
        pair.t1[k][axis] = pair.t0[k][axis] + way[axis] + turn * on_grid(random);
      }
    }
  }
  return pair;
}

// The second triangle's first corner is on the first triangle's edge at t = 1/2, in passing by.
inline MovingTriangles touching(std::mt19937_64& random) {
  MovingTriangles pair = near_each_other(random);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double middle = (pair.t0[0][axis] + pair.t1[0][axis] + pair.t0[1][axis] + pair.t1[1][axis]) / 4;
    pair.t0[3][axis] = 2 * middle - pair.t1[3][axis];
  }
  return pair;
}

}  // namespace warmfront::testing
