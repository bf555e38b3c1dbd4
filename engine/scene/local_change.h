// SPDX-License-Identifier: Apache-2.0
// What other elements of a body leave as it was, and near which vertices they do not. Plain values and pure
// functions; these throw Stopped when told to stop.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// A body has other faces and edges on the vertices that it had, few of them others. Numbers count from the
/// body's first of their kind; `before` are those of the renumbered scene that it was in, the others those of
/// the body alone: as given, and after renumber() renumbered as well.
struct LocalChange {
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr EdgeId kNoEdge{kNone};

  /// More than one element in so many is another one: then nothing is told, since building anew costs about
  /// as much.
  static constexpr std::size_t kLeastShare = 8;

  /// How near a vertex is to an element that went or came: it is one of its vertices; it shares a face or
  /// lone edge with such a vertex; with one of these; or none of this.
  enum class Near : std::uint8_t { kFar, kAt, kBeside, kNext };

  std::vector<std::uint32_t> face_before;  ///< by face: the same one before, or kNone
  std::vector<std::uint32_t> face_of;      ///< by face before: the same one, or kNone
  std::vector<EdgeId> edge_before;         ///< likewise, or kNoEdge; edges keep their order
  std::vector<EdgeId> edge_of;
  std::vector<Near> near;  ///< by vertex

  /// As of `numbering`, which is of the body alone.
  void renumber(const Renumbering& numbering, StopSignal stop);
};

/// `part` is the body's range in the renumbered scene `before` of `numbering`, in which its faces are those
/// that were given for the same range; `alone` the body with its other elements, whose vertices have these
/// given numbers. Faces are the same that have the same vertices in the same order, and keep their order
/// among each other. Nothing where more than one element in kLeastShare is another one. O(elements of the
/// body).
std::optional<LocalChange> find_local_change(const Scene& before, const Renumbering& numbering,
                                             const MeshRange& part, const Scene& alone,
                                             std::span<const GivenVertex> given_vertices, StopSignal stop);

}  // namespace warmfront
