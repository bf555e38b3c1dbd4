// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/description_checks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/digits.h"

namespace warmfront {

namespace {

// Of element `i` of a list of this name.
template <class Element>
Status check_indices(const char* name, std::size_t i, const Element& element, std::uint32_t vertex_count,
                     const char* hint) {
  for (std::size_t k = 0; k < element.size(); ++k) {
    if (element[k] < 0 || element[k] >= std::int64_t{vertex_count})
      return invalid_argument(std::string(name) + "[" + std::to_string(i) + "][" + std::to_string(k) +
                              "]: vertex index " + std::to_string(element[k]) + " is not in [0, " +
                              std::to_string(vertex_count) + ")" + hint);
  }
  return {};
}

}  // namespace

Status check_faces(const SceneDescription& description, StopSignal stop, const char* hint) {
  PacedStop paced(stop);
  for (std::size_t f = 0; f < description.faces.size(); ++f) {
    paced.check();
    if (Status valid = check_indices("faces", f, description.faces[f], description.vertex_count, hint);
        !valid)
      return valid;
  }
  return {};
}

Status check_edges(const SceneDescription& description, StopSignal stop, const char* hint) {
  PacedStop paced(stop);
  for (std::size_t e = 0; e < description.edges.size(); ++e) {
    paced.check();
    const auto& edge = description.edges[e];
    if (Status valid = check_indices("edges", e, edge, description.vertex_count, hint); !valid) return valid;
    if (edge[0] == edge[1])
      return invalid_argument("edges[" + std::to_string(e) + "]: joins vertex " + std::to_string(edge[0]) +
                              " to itself; leave it out: a vertex of no face is a point without it");
  }
  return {};
}

// Primitive, side and node numbers are 32 bit, two of which say what a primitive is.
Status check_size(std::uint64_t vertices, std::uint64_t faces, std::uint64_t edges) {
  constexpr std::uint64_t kMost = 0x3fffffff;
  if (vertices + faces + edges > kMost)
    return invalid_argument("faces: " + std::to_string(faces) + " faces, " + std::to_string(vertices) +
                            " vertices and " + std::to_string(edges) +
                            " edges given besides are together more than 2^30 - 1");
  if (edges > 0 && 3 * faces + edges > kMost)
    return invalid_argument("edges: " + std::to_string(edges) + " beside the sides of " +
                            std::to_string(faces) + " faces may be more than 2^30 - 1");
  return {};
}

namespace {

Status check_length(double thickness, const std::string& where) {
  if (thickness >= 0 && thickness <= kMostThickness) return {};
  return invalid_argument(where + ": is " + digits_of(thickness) +
                          "; give a length from 0 to 2^1020, in the scene's unit");
}

}  // namespace

Status check_thickness(const SceneDescription& description, StopSignal stop) {
  const std::vector<double>& thickness = description.thickness;
  if (thickness.empty()) return {};
  if (thickness.size() != description.vertex_count)
    return invalid_argument("thickness: " + std::to_string(thickness.size()) + " values for " +
                            std::to_string(description.vertex_count) + " vertices; give one for each");
  PacedStop paced(stop);
  for (std::size_t v = 0; v < thickness.size(); ++v) {
    paced.check();
    if (Status status = check_length(thickness[v], "thickness[" + std::to_string(v) + "]"); !status)
      return status;
  }
  return {};
}

std::string name_of(std::size_t body) {
  return "bodies[" + std::to_string(body) + "]";
}

std::string in_words(std::size_t index, const Body& body) {
  std::string words = "body " + std::to_string(index);
  if (body.name.empty()) return words;
  constexpr std::size_t kMostShown = 64;
  std::size_t shown = std::min(body.name.size(), kMostShown);
  const auto continues = [&](std::size_t i) {
    return (static_cast<unsigned char>(body.name[i]) & 0xc0) == 0x80;
  };
  while (shown < body.name.size() && shown > 0 && continues(shown)) --shown;  // a character is whole
  words += " (\"";
  // A message is one line, whatever a name holds.
  for (const char c : body.name.substr(0, shown))
    words += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return words + (shown < body.name.size() ? "...\")" : "\")");
}

Error of_body(const std::string& where, std::size_t index, const Body& body, const Error& wrong) {
  return {wrong.code, where + ": " + in_words(index, body) + ": " + wrong.message};
}

namespace {

Status check_half_space(const Body& body, const std::string& where) {
  if (body.vertex_count > 0)
    return invalid_argument(where + ".half_space: the body has " + std::to_string(body.vertex_count) +
                            " vertices; a half-space is a body of its own, without a mesh");
  if (body.kind == BodyKind::kDeformable)
    return invalid_argument(where + ".kind: is deformable; a half-space is static or rigid");
  const auto& [point, normal] = *body.half_space;
  bool zero = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(point[axis]))
      return invalid_argument(where + ".half_space.point." + "xyz"[axis] +
                              ": is not finite; coordinates must be");
    if (!(std::fabs(normal[axis]) <= kMostNormal))
      return invalid_argument(where + ".half_space.normal." + "xyz"[axis] + ": is " +
                              std::to_string(normal[axis]) + "; give a finite number of at most 2^1020");
    zero = zero && normal[axis] == 0;
  }
  if (zero)
    return invalid_argument(where + ".half_space.normal: is zero; give the direction out of the half-space");
  return {};
}

}  // namespace

Status check_body_number(const std::string& where, std::uint32_t number, std::size_t bodies) {
  if (number < bodies) return {};
  if (bodies == 0)
    return invalid_argument(
        where + ": body " + std::to_string(number) +
        " is named, and the scene was made without bodies; make it with them, or leave it out");
  return invalid_argument(where + ": body " + std::to_string(number) + " is not in [0, " +
                          std::to_string(bodies) + "); give the number of one of the scene's bodies");
}

Status check_body(const Body& body, const std::string& where) {
  if (Status status = check_name(body.name, where); !status) return status;
  if (Status status = check_length(body.thickness, where + ".thickness"); !status) return status;
  if (body.screw && body.kind != BodyKind::kRigid && body.kind != BodyKind::kRemoved)
    return invalid_argument(where + ".screw: the body is not rigid; only what poses move goes along a screw");
  if (body.screw && body.half_space)
    return invalid_argument(where + ".screw: the body is a half-space, which moves along lines only");
  if (body.half_space) {
    if (Status status = check_half_space(body, where); !status) return status;
  } else if (body.vertex_count == 0 && body.kind != BodyKind::kRemoved) {
    return invalid_argument(
        where + ".vertex_count: is 0; give it vertices, or the half_space or kind of a body without");
  }
  if (body.group == 0)
    return invalid_argument(where + ".group: is 0, so that no mask can hold it; set a bit (1 by default)");
  if (body.mask == 0)
    return invalid_argument(where +
                            ".mask: is 0, which excludes every body; set the bits of the groups to test "
                            "against, or leave the body out");
  return {};
}

Status check_half_spaces(std::span<const Body> bodies) {
  const auto count = std::ranges::count_if(
      bodies, [](const Body& body) { return body.half_space && body.kind != BodyKind::kRemoved; });
  if (std::cmp_less_equal(count, kMostHalfSpaces)) return {};
  return invalid_argument("bodies: " + std::to_string(count) + " half-spaces are more than " +
                          std::to_string(kMostHalfSpaces) + "; give a mesh instead");
}

Status check_excluded_pairs(std::span<const std::array<std::uint32_t, 2>> pairs, std::size_t bodies,
                            StopSignal stop) {
  PacedStop paced(stop);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    paced.check();
    const auto [a, b] = pairs[i];
    const auto where = [i] { return "excluded_pairs[" + std::to_string(i) + "]: body "; };
    if (std::max(a, b) >= bodies)
      return invalid_argument(where() + std::to_string(std::max(a, b)) + " is not in [0, " +
                              std::to_string(bodies) + ")");
    if (a == b)
      return invalid_argument(where() + std::to_string(a) +
                              " with itself; switch its self_collision off instead");
  }
  return {};
}

Status check_bodies(const SceneDescription& description, StopSignal stop) {
  PacedStop paced(stop);
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    paced.check();
    const Body& body = description.bodies[i];
    const std::string where = name_of(i);
    if (Status status = check_body(body, where); !status) return status;
    if (body.first_vertex != next) {
      return invalid_argument(where + ".first_vertex: is " + std::to_string(body.first_vertex) + " where " +
                              std::to_string(next) +
                              " is expected; bodies must cover all vertices in order, without " +
                              (body.first_vertex < next ? "overlap" : "gap"));
    }
    next += body.vertex_count;
    if (next > description.vertex_count) {
      return invalid_argument(where + ".vertex_count: ends at vertex " + std::to_string(next) + " of " +
                              std::to_string(description.vertex_count));
    }
  }
  if (Status status = check_half_spaces(description.bodies); !status) return status;
  if (!description.bodies.empty() && next != description.vertex_count) {
    return invalid_argument("bodies: cover " + std::to_string(next) + " of " +
                            std::to_string(description.vertex_count) + " vertices; add a body for the rest");
  }
  return check_excluded_pairs(description.excluded_pairs, description.bodies.size(), stop);
}

Status check_filters(const PairFilters& filters, std::uint32_t vertex_count, StopSignal stop) {
  const std::string where = "filters.";
  const auto of_vertices = [&](const std::string& field, std::size_t values, std::size_t each,
                               const std::string& needed_by = {}) {
    return invalid_argument(where + field + ": " + std::to_string(values) + " values where " +
                            std::to_string(each * vertex_count) + " are expected (" + std::to_string(each) +
                            " for each of " + std::to_string(vertex_count) + " vertices)" + needed_by);
  };
  if (Status numbers = filters.check_numbers(); !numbers) return numbers;
  if (filters.near_at_rest == 0 && !filters.rest_positions.empty())
    return invalid_argument(where + "rest_positions: has no effect while near_at_rest is 0; leave it out");
  if (filters.near_at_rest > 0 && filters.rest_positions.size() != std::size_t{3} * vertex_count)
    return of_vertices("rest_positions", filters.rest_positions.size(), 3, "; near_at_rest needs them");
  PacedStop paced(stop);
  for (std::size_t i = 0; i < filters.rest_positions.size(); ++i) {
    paced.check();
    if (!std::isfinite(filters.rest_positions[i]))
      return invalid_argument(where + "rest_positions[" + std::to_string(i / 3) + "]." + "xyz"[i % 3] +
                              ": is not finite; coordinates must be");
  }
  for (std::size_t i = 0; i < filters.excluded_vertex_pairs.size(); ++i) {
    paced.check();
    const auto [a, b] = filters.excluded_vertex_pairs[i];
    const auto pair = [&] { return where + "excluded_vertex_pairs[" + std::to_string(i) + "]: vertex "; };
    if (std::max(a, b) >= vertex_count)
      return invalid_argument(pair() + std::to_string(std::max(a, b)) + " is not in [0, " +
                              std::to_string(vertex_count) + ")");
    if (a == b)
      return invalid_argument(pair() + std::to_string(a) + " with itself has no effect; leave it out");
  }
  if (!filters.patches.empty() && filters.patches.size() != vertex_count)
    return of_vertices("patches", filters.patches.size(), 1);
  return {};
}

Status check_description(const SceneDescription& description, StopSignal stop, const char* hint) {
  if (Status status = check_faces(description, stop, hint); !status) return status;
  if (Status status = check_edges(description, stop, hint); !status) return status;
  if (Status status = check_bodies(description, stop); !status) return status;
  if (Status status = check_filters(description.filters, description.vertex_count, stop); !status)
    return status;
  if (Status status = check_thickness(description, stop); !status) return status;
  return check_size(description.vertex_count, description.faces.size(), description.edges.size());
}

Status check_edges_of_bodies(std::span<const Edge> edges, std::span<const std::uint32_t> lone_edges,
                             std::span<const std::uint32_t> body_of_vertex, StopSignal stop) {
  PacedStop paced(stop);
  for (const std::uint32_t e : lone_edges) {
    paced.check();
    const auto [v, w] = edges[e];
    if (body_of_vertex[v] != body_of_vertex[w])
      return invalid_argument(
          "edges: (" + std::to_string(v) + ", " + std::to_string(w) + ") joins " +
          name_of(body_of_vertex[v]) + " and " + name_of(body_of_vertex[w]) +
          "; an edge lies within one body: split the strand there, or give both vertices to one");
  }
  return {};
}

Status check_faces_of_bodies(std::span<const Face> faces, std::span<const std::uint32_t> body_of_vertex,
                             StopSignal stop) {
  PacedStop paced(stop);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    paced.check();
    for (const std::uint32_t v : faces[f]) {
      const std::uint32_t body = body_of_vertex[faces[f][0]];
      if (body_of_vertex[v] != body)
        return invalid_argument("faces[" + std::to_string(f) + "]: joins " + name_of(body) + " and " +
                                name_of(body_of_vertex[v]) + "; a face lies within one body");
    }
  }
  return {};
}

}  // namespace warmfront
