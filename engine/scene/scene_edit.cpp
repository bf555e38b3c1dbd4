// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/scene_edit.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/changed_scene.h"
#include "engine/scene/description_checks.h"

namespace warmfront {
namespace {

constexpr const char* kOwnVertices = "; a body's faces and edges number its own vertices, from 0";

// Are these a rest shape of a body that is added?
Status check_rest_shape(const Body& body, std::span<const double> positions, const std::string& where,
                        StopSignal stop) {
  if (body.half_space) return {};  // has none
  if (positions.empty())
    return Error{ErrorCode::kFailedPrecondition,
                 where + ": the scene's filters have near_at_rest; give the body's positions with it"};
  const PairFilters of_body{.near_at_rest = 1, .rest_positions = {positions.begin(), positions.end()}};
  const Status status = check_filters(of_body, body.vertex_count, stop);
  if (status) return {};
  return Error{status.error().code, where + ": " + status.error().message};
}

Status check_has_mesh(const Body& body, const std::string& where) {
  if (!body.half_space) return {};
  if (body.kind == BodyKind::kRemoved)
    return invalid_argument(where +
                            ": is a half-space that was removed, and is not replaced; add another body");
  return invalid_argument(where +
                          ": a half-space is not replaced, and replaces nothing; change it, or remove it "
                          "and add another body");
}

}  // namespace

SceneDescription SceneEdit::description_of(Body body, BodyAddition addition) {
  body.first_vertex = 0;
  SceneDescription description{body.vertex_count, std::move(addition.faces), {std::move(body)}};
  description.edges = std::move(addition.edges);
  description.thickness = std::move(addition.thickness);
  return description;
}

// The body as a scene of its own, which says whether it is well formed.
Result<Scene> SceneEdit::alone(Body body, BodyAddition addition) const {
  SceneDescription description = description_of(std::move(body), std::move(addition));
  if (Status status = check_faces(description, stop_, kOwnVertices); !status) return status.error();
  if (Status status = check_edges(description, stop_, kOwnVertices); !status) return status.error();
  return Scene::create(std::move(description), stop_);
}

// The same of one that keeps its vertices. Where it was not replaced before, and few elements are others, it
// is made of what it was.
Result<ReplacedBodies::Piece> SceneEdit::with_elements(std::uint32_t index, BodyAddition elements) const {
  const auto before = pieces_.find(index);
  ReplacedBodies::Piece piece{index, {}};
  if (before != pieces_.end()) piece.positions_of = before->second.positions_of;
  SceneDescription description = description_of(scene_.bodies_[index], std::move(elements));
  if (Status status = check_description(description, stop_, kOwnVertices); !status) return status.error();
  if (before == pieces_.end()) {
    const MeshRange range = range_before(index, index + 1);
    piece.change = find_local_change(*ordered_, range, description.faces, description.edges, stop_);
    if (piece.change) {
      piece.alone = ChangedScene::as_given(*ordered_, range, std::move(description), *piece.change, stop_);
      return piece;
    }
  }
  Result<Scene> alone = Scene::create(std::move(description), stop_);
  if (!alone) return alone.error();
  piece.alone = std::move(alone).value();
  return piece;
}

Status SceneEdit::check_bodies() const {
  return check_half_spaces(scene_.bodies_);
}

Status SceneEdit::check_index(std::uint32_t index) const {
  return check_body_number("index", index, scene_.bodies_.size());
}

// Of bodies that are as they were.
MeshRange SceneEdit::range_before(std::uint32_t first, std::uint32_t end) const {
  const Body& last = before_.bodies_[end - 1];
  return mesh_range(*ordered_, before_.bodies_[first].first_vertex, last.first_vertex + last.vertex_count);
}

SceneEdit::Sizes SceneEdit::sizes_of(std::uint32_t index) const {
  if (const auto piece = pieces_.find(index); piece != pieces_.end()) return sizes_of(piece->second.alone);
  const MeshRange range = range_before(index, index + 1);
  const auto lone_before = [&](EdgeId edge) {
    return std::ranges::lower_bound(before_.lone_edges(), number_of(edge)) - before_.lone_edges().begin();
  };
  return {range.vertex_count(), range.face_count(),
          static_cast<std::uint64_t>(lone_before(range.features.end_edge) -
                                     lone_before(range.features.first_edge))};
}

// Of the vertices of a body, besides its own; empty where they have none.
std::span<const double> SceneEdit::thickness_of(std::uint32_t index) const {
  if (const auto piece = pieces_.find(index); piece != pieces_.end())
    return piece->second.alone.vertex_thickness();
  const Body& body = before_.bodies_[index];
  const std::span<const double> all = before_.vertex_thickness();
  return all.empty() ? all : all.subspan(body.first_vertex, body.vertex_count);
}

void SceneEdit::order_faces() {
  if (ordered_) return;
  ordered_ = before_;
  face_rank_ = SceneJoin::order_faces_by_body(*ordered_, stop_);
}

// The body is this from now on. Nothing has changed after an error.
Status SceneEdit::take_piece(ReplacedBodies::Piece piece) {
  const std::uint32_t index = piece.body;
  Sizes with_it = sizes_;
  if (index < scene_.bodies_.size()) with_it.subtract(sizes_of(index));
  with_it.add(sizes_of(piece.alone));
  if (Status status = check_size(with_it.vertices, with_it.faces, with_it.lone_edges); !status)
    return Error{status.error().code, name_of(index) + ": with it, " + status.error().message};
  pieces_.insert_or_assign(index, std::move(piece));
  sizes_ = with_it;
  return {};
}

Status SceneEdit::carry_out(AddBody& change, std::size_t at) {
  BodyAddition& addition = change.addition;
  const auto index = static_cast<std::uint32_t>(scene_.bodies_.size());
  const std::string where = name_of(index);
  if (before_.bodies_.empty())
    return Error{ErrorCode::kFailedPrecondition,
                 "bodies: the scene declares none; declare its bodies to add one"};
  Body body = std::move(addition.body);
  if (Status status = check_body(body, where); !status) return status.error();
  Result<Scene> added = alone(body, std::move(addition));
  if (!added) return Error{added.error().code, where + ": " + added.error().message};
  body.first_vertex = static_cast<std::uint32_t>(sizes_.vertices);
  const bool rests = filters().near_at_rest > 0;
  if (rests) {
    if (Status status = check_rest_shape(body, change.positions, where, stop_); !status)
      return status.error();
  }
  if (Status status = take_piece({index, std::move(added).value(), at}); !status) return status;
  if (rests || !filters().patches.empty()) changed_filters().append_body(body.vertex_count, change.positions);
  scene_.name_bytes_ += body.name.size();
  scene_.bodies_.push_back(std::move(body));
  return {};
}

Status SceneEdit::carry_out(ChangeFilters& change, std::size_t /*at*/) {
  if (Status status = check_filters(change.filters, static_cast<std::uint32_t>(sizes_.vertices), stop_);
      !status)
    return status.error();
  filters_ = std::move(change.filters);
  return {};
}

Status SceneEdit::carry_out(ChangeExcludedPairs& change, std::size_t /*at*/) {
  if (Status status = check_excluded_pairs(change.pairs, scene_.bodies_.size(), stop_); !status)
    return status.error();
  scene_.excluded_pairs_ = std::move(change.pairs);
  return {};
}

Status SceneEdit::carry_out(ChangeBody& change, std::size_t /*at*/) {
  auto& [index, body] = change;
  if (index < scene_.bodies_.size() && scene_.bodies_[index].kind == BodyKind::kRemoved)
    return invalid_argument(in_words(index, scene_.bodies_[index]) + " was removed; add a new one" +
                            (scene_.bodies_[index].half_space ? "" : ", or replace it"));
  return scene_.change(index, std::move(body));
}

// A scene that declares no bodies is replaced as one.
Status SceneEdit::replace_whole(ReplaceElements& change) {
  if (change.index != 0)
    return invalid_argument("body " + std::to_string(change.index) +
                            ": the scene declares no bodies; index 0 is all of it");
  SceneDescription description{before_.vertex_count(), std::move(change.faces), {}};
  description.edges = std::move(change.edges);
  description.thickness = {before_.vertex_thickness().begin(), before_.vertex_thickness().end()};
  Result<Scene> whole = Scene::create(std::move(description), stop_);
  if (!whole) return whole.error();
  scene_ = std::move(whole).value();
  scene_.filters_ = before_.filters_;
  whole_scene_ = true;
  return {};
}

Status SceneEdit::carry_out(ReplaceElements& change, std::size_t /*at*/) {
  if (before_.bodies_.empty()) return replace_whole(change);
  const std::uint32_t index = change.index;
  if (Status status = check_index(index); !status) return status;
  const Body& body = scene_.bodies_[index];
  if (Status status = check_has_mesh(body, name_of(index)); !status) return status;
  if (body.kind == BodyKind::kRemoved)
    return invalid_argument(in_words(index, body) + " was removed; replace it as a whole");
  order_faces();
  const std::span<const double> thickness = thickness_of(index);
  BodyAddition elements;
  elements.faces = std::move(change.faces);
  elements.edges = std::move(change.edges);
  elements.thickness.assign(thickness.begin(), thickness.end());
  Result<ReplacedBodies::Piece> other = with_elements(index, std::move(elements));
  if (!other) return Error{other.error().code, name_of(index) + ": " + other.error().message};
  return take_piece(std::move(other).value());
}

Status SceneEdit::carry_out(ReplaceBody& change, std::size_t at) {
  BodyAddition& addition = change.addition;
  const std::uint32_t index = change.index;
  if (before_.bodies_.empty())
    return Error{
        ErrorCode::kFailedPrecondition,
        "bodies: the scene declares none; declare its bodies to replace one, or replace the elements "
        "of all of it as body 0"};
  if (Status status = check_index(index); !status) return status;
  const std::string where = name_of(index);
  Body body = std::move(addition.body);
  if (Status status = check_body(body, where); !status) return status.error();
  for (const Body* one : {&body, &scene_.bodies_[index]}) {
    if (Status status = check_has_mesh(*one, where); !status) return status;
  }
  if (body.kind == BodyKind::kRemoved && body.vertex_count + change.positions.size() > 0)
    return invalid_argument(
        where +
        ": its description is of a removed body; give another kind with it, or no vertices and no positions");
  order_faces();
  const bool was_thick = std::ranges::any_of(thickness_of(index), [](double t) { return t > 0; });
  if (was_thick && addition.thickness.empty() && body.vertex_count > 0)
    return Error{ErrorCode::kFailedPrecondition,
                 where +
                     ".thickness: vertices of the body have thickness of their own; give the new "
                     "vertices' with it (zeros for none)"};
  Result<Scene> other = alone(body, std::move(addition));
  if (!other) return Error{other.error().code, where + ": " + other.error().message};
  Body& old = scene_.bodies_[index];
  body.first_vertex = old.first_vertex;
  if (Status status = replace_filtered(old, body, change.positions, where); !status) return status;
  if (Status status = take_piece({index, std::move(other).value(), at}); !status) return status;
  const std::uint32_t shift = body.vertex_count - old.vertex_count;
  for (std::size_t b = std::size_t{index} + 1; b < scene_.bodies_.size(); ++b)
    scene_.bodies_[b].first_vertex += shift;
  scene_.name_bytes_ += body.name.size() - old.name.size();
  old = std::move(body);
  return {};
}

// What filters say of the vertices of a body that is replaced, and of those after it.
Status SceneEdit::replace_filtered(const Body& old, const Body& body, std::span<const double> positions,
                                   const std::string& where) {
  if (!filters().any()) return {};
  const std::uint32_t end = old.first_vertex + old.vertex_count;
  PacedStop paced(stop_);
  for (std::size_t i = 0; i < filters().excluded_vertex_pairs.size(); ++i) {
    paced.check();
    for (const std::uint32_t v : filters().excluded_vertex_pairs[i]) {
      if (v >= old.first_vertex && v < end)
        return Error{ErrorCode::kFailedPrecondition,
                     where + ": filters.excluded_vertex_pairs[" + std::to_string(i) + "] names vertex " +
                         std::to_string(v) + ", which goes; give filters without it before"};
    }
  }
  const bool rests = filters().near_at_rest > 0;
  if (rests && body.vertex_count > 0) {
    if (Status status = check_rest_shape(body, positions, where, stop_); !status) return status.error();
  }
  PairFilters& changed = changed_filters();
  for (auto& pair : changed.excluded_vertex_pairs) {
    paced.check();
    for (std::uint32_t& v : pair) {
      if (v >= end) v += body.vertex_count - old.vertex_count;
    }
  }
  changed.replace_body(old.first_vertex, old.vertex_count, body.vertex_count, positions);
  return {};
}

// Runs of bodies that are as they were, and the others.
std::vector<SceneSlice> SceneEdit::slices() const {
  std::vector<SceneSlice> slices;
  const auto before = static_cast<std::uint32_t>(before_.bodies_.size());
  std::uint32_t next = 0;
  const auto take_until = [&](std::uint32_t end) {
    if (next < end) slices.push_back({&*ordered_, range_before(next, end)});
  };
  for (const auto& [index, piece] : pieces_) {
    take_until(std::min(index, before));
    slices.push_back({&piece.alone, all_of(piece.alone), index});
    next = index + 1;
  }
  take_until(before);
  return slices;
}

Scene SceneEdit::finish(ReplacedBodies& replaced) {
  replaced.whole_scene = whole_scene_;
  if (!pieces_.empty()) {
    const bool appended = !ordered_;  // nothing but
    if (appended) ordered_ = before_;
    std::vector<SceneSlice> parts;
    if (appended) {
      parts.push_back({&before_, all_of(before_)});
      for (const auto& [index, piece] : pieces_) parts.push_back({&piece.alone, all_of(piece.alone), index});
    } else {
      parts = slices();
    }
    scene_.mesh_ =
        std::move(SceneJoin::join(parts, static_cast<std::uint32_t>(scene_.bodies_.size()), stop_).mesh_);
    if (!appended) {
      replaced.pieces.reserve(pieces_.size());
      for (auto& [index, piece] : pieces_) replaced.pieces.push_back(std::move(piece));
      replaced.face_rank = std::move(face_rank_);
    }
  }
  if (filters_)
    scene_.filters_ = filters_->any() ? std::make_shared<const PairFilters>(*std::move(filters_)) : nullptr;
  return std::move(scene_);
}

}  // namespace warmfront
