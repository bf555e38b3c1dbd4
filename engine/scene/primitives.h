// SPDX-License-Identifier: Apache-2.0
// What a hierarchy holds: faces, lone edges as segments, and isolated vertices as points. Pure functions.
#pragma once

#include <cstdint>

#include "engine/scene.h"
#include "engine/scene/numbers.h"
#include "engine/scene/scene_edges.h"
#include "engine/scene/scene_join.h"

namespace warmfront {

/// A face's number, or a lone edge's or isolated vertex's with its bit set. Faces and vertices are numbered
/// as in the scene that it is of: as given until Renumbering::apply(), and then anew.
enum class Primitive : std::uint32_t {};

inline constexpr std::uint32_t kSegmentBit = 0x40000000;
inline constexpr std::uint32_t kPointBit = 0x80000000;

constexpr Primitive primitive_of_face(std::uint32_t face) {
  return Primitive{face};
}
constexpr Primitive primitive_of_edge(EdgeId edge) {
  return Primitive{kSegmentBit | number_of(edge)};
}
constexpr Primitive primitive_of_vertex(std::uint32_t vertex) {
  return Primitive{kPointBit | vertex};
}

constexpr bool is_face(Primitive p) {
  return (static_cast<std::uint32_t>(p) & (kSegmentBit | kPointBit)) == 0;
}
constexpr bool is_segment(Primitive p) {
  return (static_cast<std::uint32_t>(p) & kSegmentBit) != 0;
}
constexpr bool is_point(Primitive p) {
  return (static_cast<std::uint32_t>(p) & kPointBit) != 0;
}
/// Of two of any kind.
constexpr bool are_faces(Primitive p, Primitive q) {
  return is_face(Primitive{static_cast<std::uint32_t>(p) | static_cast<std::uint32_t>(q)});
}
constexpr bool has_point(Primitive p, Primitive q) {
  return is_point(Primitive{static_cast<std::uint32_t>(p) | static_cast<std::uint32_t>(q)});
}

/// Its number without the bits that say what it is; by its kind below.
constexpr std::uint32_t number_in_kind(Primitive p) {
  return static_cast<std::uint32_t>(p) & ~(kSegmentBit | kPointBit);
}
constexpr std::uint32_t face_number(Primitive face) {
  return static_cast<std::uint32_t>(face);  // no bits to remove
}
constexpr EdgeId edge_id(Primitive segment) {
  return EdgeId{number_in_kind(segment)};
}
constexpr std::uint32_t vertex_number(Primitive point) {
  return number_in_kind(point);
}

/// The same primitive where numbers begin elsewhere.
constexpr Primitive shifted(Primitive p, const NumberShift& by) {
  return Primitive{static_cast<std::uint32_t>(p) + (is_face(p)      ? by.face
                                                    : is_segment(p) ? by.edge
                                                                    : by.vertex)};
}

/// The vertices of a primitive; the last of a segment or a point is repeated.
inline Face primitive_vertices(const Scene& scene, Primitive primitive) {
  if (is_face(primitive)) return scene.faces()[face_number(primitive)];
  if (is_segment(primitive)) {
    const Edge& edge = ends_of(scene, edge_id(primitive));
    return {edge[0], edge[1], edge[1]};
  }
  const std::uint32_t v = vertex_number(primitive);
  return {v, v, v};
}

}  // namespace warmfront
