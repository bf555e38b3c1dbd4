// SPDX-License-Identifier: Apache-2.0
// Replaced elements and bodies: the requests, and what they make of the scene that is kept for a resume.
#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "client/lib/scene_state.h"
#include "proto/wire/chunked_array.h"

namespace warmfront::client {
namespace {

// Elements by body, those of each in their order; those of body `index` are `others`, which count from 0, and
// vertices of the bodies after it, which begin at `end`, have numbers that are `shift` more.
template <class Element>
void replace_elements(std::vector<Element>& elements, const SceneDescription& before, std::uint32_t index,
                      const std::vector<Element>& others, std::int32_t shift) {
  const std::vector<Body>& bodies = before.bodies;
  const auto body_of = [&](const Element& element) {
    const auto vertex = static_cast<std::uint32_t>(element[0]);
    const auto next = std::ranges::upper_bound(bodies, vertex, {}, &Body::first_vertex);
    return static_cast<std::uint32_t>(next - bodies.begin()) - 1;
  };
  std::ranges::stable_sort(elements, {}, body_of);
  const auto from = std::ranges::lower_bound(elements, index, {}, body_of);
  const auto to = std::ranges::upper_bound(elements, index, {}, body_of);
  std::vector<Element> result(elements.begin(), from);
  result.reserve(elements.size() + others.size());
  const auto append = [&](Element element, std::int32_t by) {
    for (std::int32_t& vertex : element) vertex += by;
    result.push_back(element);
  };
  for (const Element& element : others)
    append(element, static_cast<std::int32_t>(bodies[index].first_vertex));
  for (const Element& element : std::span(to, elements.end())) append(element, shift);
  elements = std::move(result);
}

}  // namespace

Status SceneState::check_index(std::uint32_t index) const {
  if (index < scene_.bodies.size()) return {};
  return invalid_argument("body " + std::to_string(index) + " is not in [0, " +
                          std::to_string(scene_.bodies.size()) + ")");
}

void SceneState::replace_mesh(std::uint32_t index, std::uint32_t count,
                              const std::vector<std::array<std::int32_t, 3>>& faces,
                              const std::vector<std::array<std::int32_t, 2>>& edges) {
  const auto shift = static_cast<std::int32_t>(count - scene_.bodies[index].vertex_count);
  replace_elements(scene_.faces, scene_, index, faces, shift);
  replace_elements(scene_.edges, scene_, index, edges, shift);
}

Result<v1::SceneChange> SceneState::encode(const ReplaceElements& replacement) const {
  // Without bodies index 0 is the whole scene, of which the daemon tells.
  if (!scene_.bodies.empty()) {
    if (Status known = check_index(replacement.index); !known) return known.error();
  }
  v1::SceneChange change;
  change.mutable_replace_elements()->set_index(replacement.index);
  change.mutable_replace_elements()->set_faces(std::string(wire::as_bytes(replacement.faces)));
  change.mutable_replace_elements()->set_edges(std::string(wire::as_bytes(replacement.edges)));
  return change;
}

void SceneState::take(ReplaceElements replacement) {
  if (scene_.bodies.empty()) {
    scene_.faces = std::move(replacement.faces);
    scene_.edges = std::move(replacement.edges);
    return;
  }
  replace_mesh(replacement.index, scene_.bodies[replacement.index].vertex_count, replacement.faces,
               replacement.edges);
}

Result<v1::SceneChange> SceneState::encode(std::uint32_t index, const BodyAddition& with,
                                           const Positions& positions) const {
  // Without bodies the daemon tells what to do.
  if (!scene_.bodies.empty()) {
    if (Status known = check_index(index); !known) return known.error();
  }
  Result<v1::BodyAddition> body = encode_body(with, positions);
  if (!body) return body.error();
  v1::SceneChange change;
  change.mutable_replace_body()->set_index(index);
  *change.mutable_replace_body()->mutable_with() = std::move(body).value();
  return change;
}

void SceneState::take(std::uint32_t index, BodyAddition with, const Positions& positions) {
  const std::uint32_t count = with.body.vertex_count;
  replace_mesh(index, count, with.faces, with.edges);
  Body& body = scene_.bodies[index];
  const std::uint32_t first = body.first_vertex;
  const std::uint32_t before = body.vertex_count;
  for (auto& pair : scene_.filters.excluded_vertex_pairs) {
    for (std::uint32_t& vertex : pair) {
      if (vertex >= first + before) vertex += count - before;
    }
  }
  const auto replace_filtered = [&](std::span<const double> values) {
    scene_.filters.replace_body(first, before, count, values);
  };
  std::visit([&](auto values) { replace_filtered(std::vector<double>(values.begin(), values.end())); },
             positions);
  const std::size_t row = 3 * number_size();
  const auto bytes = [](auto values) {
    return std::string_view(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  };
  own_positions().replace(row * first, row * before, std::visit(bytes, positions));
  std::vector<double>& thickness = scene_.thickness;
  if (thickness.empty() && !with.thickness.empty()) thickness.resize(scene_.vertex_count);
  if (!thickness.empty()) {
    with.thickness.resize(count);
    const auto at = thickness.begin() + first;
    thickness.insert(thickness.erase(at, at + before), with.thickness.begin(), with.thickness.end());
  }
  scene_.vertex_count += count - before;
  for (std::size_t b = std::size_t{index} + 1; b < scene_.bodies.size(); ++b)
    scene_.bodies[b].first_vertex += count - before;
  with.body.first_vertex = first;
  body = std::move(with.body);
  poses_[index].reset();
}

}  // namespace warmfront::client
