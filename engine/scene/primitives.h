// SPDX-License-Identifier: Apache-2.0
// What a hierarchy holds: faces, lone edges as segments, and isolated vertices as points. Pure functions.
#pragma once

#include "engine/scene.h"
#include "engine/scene/scene_join.h"

namespace warmfront {

constexpr bool is_face(Primitive p) {
  return (p & (kSegment | kPoint)) == 0;
}
constexpr bool is_segment(Primitive p) {
  return (p & kSegment) != 0;
}
constexpr bool is_point(Primitive p) {
  return (p & kPoint) != 0;
}
/// Of two, of which one may be of any kind: are both faces?
constexpr bool are_faces(Primitive p, Primitive q) {
  return is_face(p | q);
}
/// Its number without the bits that say what it is.
constexpr std::uint32_t number_in_kind(Primitive p) {
  return p & ~(kSegment | kPoint);
}

/// The same primitive where numbers begin elsewhere.
constexpr Primitive shifted(Primitive p, const NumberShift& by) {
  return p + (is_face(p) ? by.face : is_segment(p) ? by.edge : by.vertex);
}

/// The vertices of a primitive; the last of a segment or a point is repeated.
inline Face primitive_vertices(const Scene& scene, Primitive primitive) {
  if (is_face(primitive)) return scene.faces()[primitive];
  if (is_segment(primitive)) {
    const Edge& edge = scene.edges()[number_in_kind(primitive)];
    return {edge[0], edge[1], edge[1]};
  }
  const std::uint32_t v = number_in_kind(primitive);
  return {v, v, v};
}

}  // namespace warmfront
