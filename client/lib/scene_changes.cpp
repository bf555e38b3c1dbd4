// SPDX-License-Identifier: Apache-2.0
// Changes of the scene: for each kind the request, and what the change makes of the scene that is kept for a
// resume. Thread safety as stated in scene_state.h.
#include "client/lib/scene_changes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "client/lib/scene_state.h"
#include "client/lib/wire.h"
#include "engine/scene/description_checks.h"
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

std::string_view rows_of(const Positions& positions) {
  return std::visit(
      [](auto span) {
        return std::string_view(reinterpret_cast<const char*>(span.data()), span.size_bytes());
      },
      positions);
}

std::vector<double> numbers_of(const Positions& positions) {
  return std::visit([](auto span) { return std::vector<double>(span.begin(), span.end()); }, positions);
}

v1::BodyAddition message_of(const PutBody& put) {
  v1::BodyAddition message;
  *message.mutable_body() = to_proto(put.addition.body);
  message.set_faces(std::string(wire::as_bytes(put.addition.faces)));
  message.set_edges(std::string(wire::as_bytes(put.addition.edges)));
  message.set_positions(std::string(rows_of(put.positions)));
  message.set_thickness(std::string(wire::as_bytes(put.addition.thickness)));
  return message;
}

/// Which features each kind of change needs.
struct Features {
  std::vector<v1::Feature> operator()(const PutBody& put) const {
    const BodyAddition& of = put.addition;
    std::vector<v1::Feature> features;
    if (put.index) features.push_back(v1::FEATURE_REPLACE);
    if (of.body.thickness != 0) features.push_back(v1::FEATURE_THICKNESS);
    if (!put.index && !of.thickness.empty()) features.push_back(v1::FEATURE_REPLACE);
    if (of.body.world != 0) features.push_back(v1::FEATURE_WORLDS);
    if (of.body.screw) features.push_back(v1::FEATURE_SCREW);
    if (of.body.half_space) features.push_back(v1::FEATURE_HALF_SPACES);
    if (!of.edges.empty()) features.push_back(v1::FEATURE_EDGES);
    return features;
  }
  std::vector<v1::Feature> operator()(const ReplaceElements& /*replacement*/) const {
    return {v1::FEATURE_REPLACE};
  }
  std::vector<v1::Feature> operator()(const ChangeBody& change) const {
    std::vector<v1::Feature> features;
    if (change.body.thickness != 0) features.push_back(v1::FEATURE_THICKNESS);
    if (change.body.world != 0) features.push_back(v1::FEATURE_WORLDS);
    if (change.body.screw) features.push_back(v1::FEATURE_SCREW);
    return features;
  }
  std::vector<v1::Feature> operator()(const ChangeFilters& change) const {
    return change.filters.any() ? std::vector{v1::FEATURE_PAIR_FILTERS} : std::vector<v1::Feature>();
  }
  std::vector<v1::Feature> operator()(const ChangeExcludedPairs& /*change*/) const {
    return {v1::FEATURE_OPTION_CHANGES};
  }
};

}  // namespace

std::vector<v1::Feature> features_of(const SceneEdit& edit) {
  return std::visit(Features(), edit);
}

Result<v1::SceneChange> SceneState::encode(const SceneEdit& edit) const {
  return std::visit([this](const auto& change) { return request_for(change); }, edit);
}

void SceneState::take(SceneEdit edit) {
  std::visit([this](auto& change) { apply(std::move(change)); }, edit);
}

// Added, or in place of another body.

Result<v1::SceneChange> SceneState::request_for(const PutBody& put) const {
  const std::size_t index = put.index.value_or(static_cast<std::uint32_t>(scene_.bodies.size()));
  if (Status readable = check_name(put.addition.body.name, name_of(index)); !readable)
    return readable.error();
  // Without declared bodies the daemon tells what to do.
  if (put.index && !scene_.bodies.empty()) {
    if (Status known = check_index(*put.index); !known) return known.error();
  }
  if (Status kind = check_kind(put.positions, put.addition.body.vertex_count, "positions"); !kind)
    return kind.error();
  v1::SceneChange change;
  if (put.index) {
    change.mutable_replace_body()->set_index(*put.index);
    *change.mutable_replace_body()->mutable_with() = message_of(put);
  } else {
    *change.mutable_add() = message_of(put);
  }
  return change;
}

// A body is added as one without vertices behind all others, which the other one then takes the place of.
void SceneState::apply(PutBody&& put) {
  BodyAddition& with = put.addition;
  if (put.index)
    replace_mesh(*put.index, with.body.vertex_count, with.faces, with.edges);
  else
    append_mesh(with.faces, with.edges);
  const std::uint32_t index = put.index.value_or(static_cast<std::uint32_t>(scene_.bodies.size()));
  if (!put.index) {
    scene_.bodies.emplace_back().first_vertex = scene_.vertex_count;
    poses_.emplace_back();
  }
  const std::uint32_t first = scene_.bodies[index].first_vertex;
  const std::uint32_t before = scene_.bodies[index].vertex_count;
  const std::uint32_t count = with.body.vertex_count;
  for (auto& pair : scene_.filters.excluded_vertex_pairs) {
    for (std::uint32_t& vertex : pair) {
      if (vertex >= first + before) vertex += count - before;
    }
  }
  scene_.filters.replace_body(first, before, count, numbers_of(put.positions));
  const std::size_t row = 3 * number_size();
  own_positions().replace(row * first, row * before, rows_of(put.positions));
  std::vector<double>& thickness = scene_.thickness;
  if (thickness.empty() && !with.thickness.empty()) thickness.resize(scene_.vertex_count);
  if (!thickness.empty()) {
    with.thickness.resize(count);
    const auto at = thickness.begin() + first;
    thickness.insert(thickness.erase(at, at + before), with.thickness.begin(), with.thickness.end());
    forget_zero_thickness();
  }
  scene_.vertex_count += count - before;
  for (std::size_t b = std::size_t{index} + 1; b < scene_.bodies.size(); ++b)
    scene_.bodies[b].first_vertex += count - before;
  with.body.first_vertex = first;
  scene_.bodies[index] = std::move(with.body);
  poses_[index].reset();
}

void SceneState::append_mesh(const std::vector<std::array<std::int32_t, 3>>& faces,
                             const std::vector<std::array<std::int32_t, 2>>& edges) {
  const auto first = static_cast<std::int32_t>(scene_.vertex_count);
  for (const auto& [a, b, c] : faces) scene_.faces.push_back({a + first, b + first, c + first});
  for (const auto& [a, b] : edges) scene_.edges.push_back({a + first, b + first});
}

// Other elements of the same vertices.

Result<v1::SceneChange> SceneState::request_for(const ReplaceElements& replacement) const {
  // Without declared bodies index 0 is the whole scene, of which the daemon tells.
  if (!scene_.bodies.empty()) {
    if (Status known = check_index(replacement.index); !known) return known.error();
  }
  v1::SceneChange change;
  change.mutable_replace_elements()->set_index(replacement.index);
  change.mutable_replace_elements()->set_faces(std::string(wire::as_bytes(replacement.faces)));
  change.mutable_replace_elements()->set_edges(std::string(wire::as_bytes(replacement.edges)));
  return change;
}

void SceneState::apply(ReplaceElements&& replacement) {
  if (scene_.bodies.empty()) {
    scene_.faces = std::move(replacement.faces);
    scene_.edges = std::move(replacement.edges);
    return;
  }
  replace_mesh(replacement.index, scene_.bodies[replacement.index].vertex_count, replacement.faces,
               replacement.edges);
}

void SceneState::replace_mesh(std::uint32_t index, std::uint32_t count,
                              const std::vector<std::array<std::int32_t, 3>>& faces,
                              const std::vector<std::array<std::int32_t, 2>>& edges) {
  const auto shift = static_cast<std::int32_t>(count - scene_.bodies[index].vertex_count);
  replace_elements(scene_.faces, scene_, index, faces, shift);
  replace_elements(scene_.edges, scene_, index, edges, shift);
}

// Another description of a body.

Result<v1::SceneChange> SceneState::request_for(const ChangeBody& change) const {
  const std::uint32_t index = change.index;
  if (Status known = check_index(index); !known) return known.error();
  if (Status readable = check_name(change.body.name, name_of(index)); !readable) return readable.error();
  const Body& old = scene_.bodies[index];
  // Of one that is removed the daemon tells.
  const bool stays = old.kind == BodyKind::kRemoved || change.body.kind == BodyKind::kRigid ||
                     change.body.kind == BodyKind::kRemoved || old.half_space;
  if (float32_ && poses_[index] && !stays)
    return Error{ErrorCode::kFailedPrecondition,
                 "body " + std::to_string(index) +
                     " is at a pose, and its vertices are not known in the session's float32; give its "
                     "positions in a frame before it becomes another kind"};
  v1::SceneChange encoded;
  encoded.mutable_change()->set_index(index);
  *encoded.mutable_change()->mutable_body() = to_proto(change.body);
  // The daemon keeps the range and ignores this field, but it must not be empty where the body has a mesh.
  encoded.mutable_change()->mutable_body()->set_vertex_count(old.vertex_count);
  return encoded;
}

void SceneState::apply(ChangeBody&& change) {
  const std::uint32_t index = change.index;
  Body& body = change.body;
  Body& old = scene_.bodies[index];
  body.first_vertex = old.first_vertex;
  body.vertex_count = old.vertex_count;
  if (!body.half_space) body.half_space = old.half_space;  // of one that is removed
  // Its new description also places it.
  if (body.half_space && (body.kind != old.kind || body.half_space != old.half_space)) poses_[index].reset();
  // One that is removed keeps its pose, which is of interest to who asks where its vertices are.
  if (poses_[index] && body.kind != BodyKind::kRigid && body.kind != BodyKind::kRemoved) {
    for (std::uint32_t v = 0; v < old.vertex_count && !float32_; ++v) {
      char* row = own_positions().data() + 3 * sizeof(double) * (old.first_vertex + v);
      std::array<double, 3> x;
      std::memcpy(x.data(), row, sizeof x);
      x = poses_[index]->place(x.data());
      std::memcpy(row, x.data(), sizeof x);
    }
    poses_[index].reset();
  }
  old = std::move(body);
}

// Other pairs that do not count.

Result<v1::SceneChange> SceneState::request_for(const ChangeFilters& change) const {
  v1::SceneChange encoded;
  *encoded.mutable_change_filters() = to_proto(change.filters);
  return encoded;
}

Result<v1::SceneChange> SceneState::request_for(const ChangeExcludedPairs& change) const {
  v1::SceneChange encoded;
  wire::set_body_pairs(*encoded.mutable_change_excluded_pairs()->mutable_pairs(), change.pairs);
  return encoded;
}

}  // namespace warmfront::client
