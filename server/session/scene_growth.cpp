// SPDX-License-Identifier: Apache-2.0
#include "server/session/scene_growth.h"

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "server/session/account.h"

namespace warmfront::server {

std::optional<Fault> too_large_with(const Scene& scene, std::span<const SceneChange> changes,
                                    const Limits& limits) {
  const std::span<const Body> bodies = scene.bodies();
  struct Size {
    std::uint64_t vertices = 0, elements = 0;
  };
  Size all{scene.vertex_count(), scene.element_count()};
  std::vector<Size> of_body;  // once some is replaced
  std::vector<Size> added;    // before that
  const auto count_bodies = [&] {
    if (!of_body.empty() || bodies.empty()) return;
    for (const Body& body : bodies) of_body.push_back({body.vertex_count, 0});
    of_body.insert(of_body.end(), added.begin(), added.end());
    for (const Face& face : scene.faces()) ++of_body[scene.body_of_vertex()[face[0]]].elements;
    for (const std::uint32_t e : scene.lone_edges())
      ++of_body[scene.body_of_vertex()[scene.edges()[e][0]]].elements;
  };
  // Without declared bodies only all of it is replaced.
  const auto replace = [&](std::uint32_t index, std::optional<std::uint64_t> vertices,
                           std::uint64_t elements) {
    count_bodies();
    if (bodies.empty()) {
      all.elements = elements;
    } else if (index < of_body.size()) {
      Size& size = of_body[index];
      const Size with{vertices.value_or(size.vertices), elements};
      all = {all.vertices - size.vertices + with.vertices, all.elements - size.elements + with.elements};
      size = with;
    }
  };
  const auto elements_of = [](const auto& of) { return of.faces.size() + of.edges.size(); };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (const auto* elements = std::get_if<ReplaceElements>(&changes[i])) {
      replace(elements->index, std::nullopt, elements_of(*elements));
    } else if (const auto* body = std::get_if<ReplaceBody>(&changes[i])) {
      replace(body->index, body->addition.body.vertex_count, elements_of(body->addition));
    } else if (const auto* add = std::get_if<AddBody>(&changes[i])) {
      const Size size{add->addition.body.vertex_count, elements_of(add->addition)};
      (of_body.empty() ? added : of_body).push_back(size);
      all = {all.vertices + size.vertices, all.elements + size.elements};
    } else {
      continue;
    }
    const std::string where = "changes[" + std::to_string(i) + "]: ";
    if (all.vertices > limits.max_vertices)
      return too_large(where + "vertices of the scene", all.vertices, limits.max_vertices, "max-vertices");
    if (all.elements > limits.max_triangles)
      return too_large(where + "faces and lone edges of the scene", all.elements, limits.max_triangles,
                       "max-triangles");
  }
  return std::nullopt;
}

std::size_t growth_with(const Scene& scene, std::span<const SceneChange> changes, const ScenePrice& price) {
  const std::uint64_t vertices = scene.vertex_count();
  const std::uint64_t elements = scene.element_count();
  std::uint64_t more_vertices = 0, more_elements = 0;
  const PairFilters* other = nullptr;  // in place of the scene's
  const bool is_thick = scene.most_thickness() > 0;
  bool becomes_thick = is_thick;
  bool replaces = false;
  const auto grow_by = [&](const BodyAddition& body) {
    becomes_thick |= body.body.thickness > 0 || !body.thickness.empty();
    more_vertices += body.body.vertex_count;
    if (body.body.half_space) more_vertices += kVerticesPerHalfSpace;
    more_elements += body.faces.size() + body.edges.size();
  };
  for (const SceneChange& change : changes) {
    if (const auto* body = std::get_if<ChangeBody>(&change)) becomes_thick |= body->body.thickness > 0;
    if (const auto* filters = std::get_if<ChangeFilters>(&change)) other = &filters->filters;
    if (const auto* add = std::get_if<AddBody>(&change)) grow_by(add->addition);
    if (const auto* elements_of = std::get_if<ReplaceElements>(&change)) {
      replaces = true;
      more_elements += elements_of->faces.size() + elements_of->edges.size();
    }
    if (const auto* body = std::get_if<ReplaceBody>(&change)) {
      replaces = true;
      grow_by(body->addition);
    }
  }
  const auto estimate = [&](std::uint64_t v, std::uint64_t e, bool thick) {
    return estimate_bytes(v, e, price.bytes_per_number, price.explain, thick, price.limits);
  };
  const auto of_filters = [&](const PairFilters& filters, std::uint64_t v) {
    return estimate_filter_bytes(FilterSize::of(filters), v, price.explain);
  };
  // Other filters are made beside those that there are; these grow with the bodies that are added.
  const PairFilters& present = scene.filters();
  const std::size_t more_filters =
      other != nullptr ? of_filters(*other, vertices + more_vertices)
                       : of_filters(present, vertices + more_vertices) - of_filters(present, vertices);
  // The scene, and the same in the order of the hierarchies, are made beside what is there, and a list that
  // grows is copied; without declared bodies all is.
  constexpr std::size_t kBesideAVertex = 200, kBesideAnElement = 320;
  const std::size_t beside = !replaces ? 0
                             : scene.bodies().empty()
                                 ? estimate(vertices, elements, is_thick)
                                 : kBesideAVertex * vertices + kBesideAnElement * elements;
  return estimate(vertices + more_vertices, elements + more_elements, becomes_thick) -
         estimate(vertices, elements, is_thick) + more_filters + beside;
}

Fault with_removed(Fault refusal, const Scene& scene) {
  const std::span<const Body> bodies = scene.bodies();
  std::uint64_t count = 0, vertices = 0, faces = 0;
  for (const Body& body : bodies) {
    if (body.kind != BodyKind::kRemoved) continue;
    ++count;
    vertices += body.vertex_count;
  }
  if (count == 0) return refusal;
  for (const Face& face : scene.faces())
    faces += bodies[scene.body_of_vertex()[face[0]]].kind == BodyKind::kRemoved;
  constexpr std::uint64_t kGoodPart = 4;  // one of so many
  if (kGoodPart * vertices <= scene.vertex_count() && kGoodPart * faces <= scene.face_count()) return refusal;
  refusal.message +=
      "; " + std::to_string(vertices) + " of its " + std::to_string(scene.vertex_count()) + " vertices and " +
      std::to_string(faces) + " of its " + std::to_string(scene.face_count()) + " faces are of " +
      std::to_string(count) +
      " removed bodies, which are kept: replacing these by removed bodies without vertices, or "
      "creating the session again without them, frees them";
  return refusal;
}

}  // namespace warmfront::server
