// SPDX-License-Identifier: Apache-2.0
// Pieces of changes: see scene_change_pieces.h.
#include "proto/wire/scene_change_pieces.h"

namespace warmfront::wire {
namespace {

std::vector<std::string*> arrays_of(v1::BodyAddition& body) {
  return {body.mutable_faces(), body.mutable_edges(), body.mutable_positions(), body.mutable_thickness()};
}

}  // namespace

std::vector<std::string*> arrays_of(v1::SceneChange& change) {
  switch (change.what_case()) {
    case v1::SceneChange::kAdd:
      return arrays_of(*change.mutable_add());
    case v1::SceneChange::kReplaceBody:
      return arrays_of(*change.mutable_replace_body()->mutable_with());
    case v1::SceneChange::kReplaceElements:
      return {change.mutable_replace_elements()->mutable_faces(),
              change.mutable_replace_elements()->mutable_edges()};
    case v1::SceneChange::kChangeFilters:
      return {change.mutable_change_filters()->mutable_rest_positions(),
              change.mutable_change_filters()->mutable_excluded_vertex_pairs(),
              change.mutable_change_filters()->mutable_patches()};
    case v1::SceneChange::kChange:
    case v1::SceneChange::kChangeExcludedPairs:
    case v1::SceneChange::WHAT_NOT_SET:
      break;
  }
  return {};
}

v1::SceneChange piece_of(const v1::SceneChange& change) {
  v1::SceneChange piece;
  if (change.has_add()) piece.mutable_add();
  if (change.has_replace_body()) piece.mutable_replace_body()->mutable_with();
  if (change.has_replace_elements()) piece.mutable_replace_elements();
  if (change.has_change_filters()) piece.mutable_change_filters();
  return piece;
}

Status append_piece(v1::SceneChange& to, v1::SceneChange&& piece, const std::string& where) {
  const std::vector<std::string*> more = arrays_of(piece);
  if (more.empty() || piece.what_case() != to.what_case())
    return invalid_argument(where + ".continues: the change before it is of another kind, or has no arrays");
  const std::vector<std::string*> arrays = arrays_of(to);
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    if (arrays[k]->empty())
      *arrays[k] = std::move(*more[k]);
    else
      arrays[k]->append(*more[k]);
    more[k]->clear();
  }
  piece.clear_continues();
  if (piece.ByteSizeLong() != piece_of(piece).ByteSizeLong())
    return invalid_argument(where +
                            ".continues: has more in it than arrays; say all else in the first piece");
  return {};
}

}  // namespace warmfront::wire
