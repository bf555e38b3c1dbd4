// SPDX-License-Identifier: Apache-2.0
// What other elements of a body leave as it was, and where they do not. Plain values and pure functions;
// these throw Stopped when told to stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/parallel/move_runs.h"
#include "engine/scene.h"
#include "engine/scene/connectivity.h"
#include "engine/scene/numbers.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// A body has other faces and edges on the vertices that it had, few of them others. Numbers count from the
/// body's first of their kind, as given until renumber(). Faces are the same that have the same vertices in
/// the same order.
struct LocalChange {
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr EdgeId kNoEdge{kNone};

  /// More than one element in so many is another one: then nothing is told, since building anew costs about
  /// as much.
  static constexpr std::size_t kLeastShare = 8;

  /// An edge that there is now, or was: of a face that went or came, or of none at either time.
  struct Touched {
    Edge ends;                ///< as given, also after renumber()
    EdgeId before = kNoEdge;  ///< kNoEdge: there was none
    EdgeId now = kNoEdge;     ///< kNoEdge: it went
    bool of_face = false;     ///< of one that went or came
    bool was_lone = false;    ///< it was of no face
    bool is_lone = false;

    /// Are the faces along it others, or is it one of no face and was not, or the reverse?
    bool changed() const { return of_face || was_lone != is_lone; }
  };

  std::vector<std::uint32_t> face_before;  ///< by face: the same one before, or kNone
  std::vector<std::uint32_t> face_of;      ///< by face before: the same one, or kNone
  std::vector<EdgeId> edge_before;         ///< likewise, or kNoEdge; edges keep their order
  std::vector<EdgeId> edge_of;
  std::vector<Run> face_runs;  ///< of faces that stay, from before to now, ascending in both
  std::vector<Run> edge_runs;
  std::vector<std::uint32_t> came;  ///< faces, ascending
  std::vector<Touched> touched;     ///< ascending
  std::vector<std::uint32_t> at;    ///< vertices of faces that went or came, and of edges of no face that did
  bool faces_ascend = true;         ///< faces that stay keep their order: before renumber() they do

  /// Faces as renumbered: before, when the body was `part` of what `before` is of, and now, by `now`, which
  /// is of the body alone. Vertices likewise. `faces` is what face_before becomes, where that is known; else
  /// empty.
  void renumber(const Renumbering& before, const MeshRange& part, const Renumbering& now,
                std::vector<std::uint32_t> faces, StopSignal stop);
};

/// `part` is the body's range in the scene `before`, as given and with its faces by body; `faces` and
/// `edges`, which were checked, are what it has now. Nothing where more than one element in kLeastShare is
/// another one. O(faces + edges given besides), of which most is comparing.
std::optional<LocalChange> find_local_change(const Scene& before, const MeshRange& part,
                                             std::span<const std::array<std::int32_t, 3>> faces,
                                             std::span<const GivenEdge> edges, StopSignal stop);

}  // namespace warmfront
