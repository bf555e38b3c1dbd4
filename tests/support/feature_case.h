// SPDX-License-Identifier: Apache-2.0
// One feature pair with its motion, written by hand or random. A plain value.
#pragma once

#include <array>

#include "engine/elementary/query.h"

namespace warmfront::testing {

/// Vertex, then the face's three; or an edge's two, then the other's two.
using Points = std::array<std::array<double, 3>, 4>;

struct FeatureCase {
  ContactKind kind;
  std::array<VertexMotion, 4> vertices;

  FeatureCase(ContactKind the_kind, const Points& t0, const Points& t1) : kind(the_kind), vertices{} {
    for (int k = 0; k < 4; ++k) {
      vertices[k].t0 = {t0[k][0], t0[k][1], t0[k][2], 0};
      vertices[k].t1 = {t1[k][0], t1[k][1], t1[k][2], 0};
    }
  }
  FeatureCase(ContactKind the_kind, const std::array<VertexMotion, 4>& the_vertices)
      : kind(the_kind), vertices(the_vertices) {}

  /// Points into this case.
  FeatureVertices features() const {
    return {kind, {&vertices[0], &vertices[1], &vertices[2], &vertices[3]}};
  }
};

inline Points moved(Points points, int vertex, double x, double y, double z) {
  points[vertex][0] += x;
  points[vertex][1] += y;
  points[vertex][2] += z;
  return points;
}

/// A vertex one above a triangle that lies in the plane z = 0.
inline constexpr Points kTriangleBelow{{{0.25, 0.25, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};

}  // namespace warmfront::testing
