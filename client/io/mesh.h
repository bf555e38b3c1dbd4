// SPDX-License-Identifier: Apache-2.0
// A triangle mesh as a file holds it: positions in the file's own precision, and faces. Plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "engine/collider.h"

namespace warmfront::client {

/// Row-major (n, 3) positions. Which alternative is held is the precision of the source: float32 stays
/// float32, so that half the bytes go over the wire; the engine converts it to double exactly.
using PositionBuffer = std::variant<std::vector<float>, std::vector<double>>;

/// The buffer as the engine takes it; valid as long as the buffer is not changed.
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

struct Mesh {
  PositionBuffer positions;
  /// (m, 3) vertex indices, each in [0, vertex_count(positions)).
  std::vector<std::array<std::int32_t, 3>> faces;
};

/// Appends the fan (p0 p1 p2), (p0 p2 p3), ... of a polygon with at least three corners.
inline void append_fan(std::span<const std::int32_t> polygon,
                       std::vector<std::array<std::int32_t, 3>>& faces) {
  for (std::size_t i = 2; i < polygon.size(); ++i) faces.push_back({polygon[0], polygon[i - 1], polygon[i]});
}

}  // namespace warmfront::client
