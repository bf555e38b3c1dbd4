// SPDX-License-Identifier: Apache-2.0
// A mesh as stored in a file: positions in the file's own precision, faces and edges. Plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "engine/collider.h"

namespace warmfront::client {

/// Row-major (n, 3) positions in the source's precision: float32 stays float32, which halves the bytes on the
/// wire; the engine converts it to double exactly.
using PositionBuffer = std::variant<std::vector<float>, std::vector<double>>;

/// A view for the engine; valid until the buffer changes.
inline Positions view(const PositionBuffer& buffer) {
  return std::visit([](const auto& values) { return Positions(std::span(values)); }, buffer);
}

/// Vertices in the buffer.
inline std::size_t vertex_count(const PositionBuffer& buffer) {
  return std::visit([](const auto& values) { return values.size() / 3; }, buffer);
}

/// Coordinate `index` (3 * vertex + axis) as a double.
inline double coordinate(const Positions& positions, std::size_t index) {
  return std::visit([index](const auto& values) { return static_cast<double>(values[index]); }, positions);
}

/// A face of more than three corners, as a file lists it: corners - 2 of a mesh's faces, from first_face on.
struct Polygon {
  std::size_t first_face = 0;
  std::size_t corners = 0;
  std::size_t line = 0;    ///< its line in the file; 0 in a binary one
  std::size_t number = 0;  ///< of the file's faces, from 0
};

struct Mesh {
  PositionBuffer positions;
  /// (m, 3) vertex indices, each in [0, vertex_count(positions)).
  std::vector<std::array<std::int32_t, 3>> faces;
  /// As parsed these are fans, which are wrong for concave polygons: see triangulate.h.
  std::vector<Polygon> polygons = {};
  /// (k, 2), listed beside the faces (OBJ l, PLY edge): of two different vertices each.
  std::vector<std::array<std::int32_t, 2>> edges = {};
};

/// Appends the fan (p0 p1 p2), (p0 p2 p3), ... of a file's face with at least three corners.
inline void append_face(std::span<const std::int32_t> corners, std::size_t line, std::size_t number,
                        Mesh& mesh) {
  if (corners.size() > 3) mesh.polygons.push_back({mesh.faces.size(), corners.size(), line, number});
  for (std::size_t i = 2; i < corners.size(); ++i)
    mesh.faces.push_back({corners[0], corners[i - 1], corners[i]});
}

}  // namespace warmfront::client
