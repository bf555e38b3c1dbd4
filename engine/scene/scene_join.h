// SPDX-License-Identifier: Apache-2.0
// Scenes put together from parts of others: what changes of a scene make of what stays and what is new. Pure
// functions; all throw Stopped when told to stop.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/scene_edges.h"
#include "engine/stop.h"

namespace warmfront {

/// Ranges of vertices, faces and edges that belong together: of a body, or of several that follow each other.
struct MeshRange {
  FeatureRange features;
  std::uint32_t first_face = 0;
  std::uint32_t end_face = 0;

  std::uint32_t vertex_count() const { return features.end_vertex - features.first_vertex; }
  std::uint32_t face_count() const { return end_face - first_face; }
  std::uint32_t edge_count() const { return features.end_edge - features.first_edge; }
};

inline MeshRange all_of(const Scene& scene) {
  return {whole(scene), 0, scene.face_count()};
}
/// Vertices [first, end), which are those of bodies, of a scene in given numbers that has its faces by body.
MeshRange mesh_range(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex);

/// What is to be added to the numbers of a range, modulo 2^32, where it begins elsewhere.
struct NumberShift {
  std::uint32_t vertex = 0;
  std::uint32_t face = 0;
  std::uint32_t edge = 0;

  bool any() const { return (vertex | face | edge) != 0; }
};
NumberShift shift_between(const MeshRange& from, const MeshRange& to);

/// A range of a scene, in whichever numbers, that becomes the next part of another. What `scene` refers to
/// outlives it.
struct SceneSlice {
  const Scene* scene = nullptr;
  MeshRange range;
  std::uint32_t body_shift = 0;  ///< is added to the numbers of its bodies, modulo 2^32
  /// The same scene where it is not needed afterwards: its memory is taken over where it comes first, is all
  /// that the range says and shares nothing. It is unspecified then.
  Scene* spare = nullptr;
};

class SceneJoin {
 public:
  /// A scene without declared bodies or filters, of `body_count` bodies, of these slices one after the other.
  /// O(scene), unless one is all of it: that is shared.
  static Scene join(std::span<const SceneSlice> slices, std::uint32_t body_count, StopSignal stop);

  /// Orders the faces of a scene by body, those of each in the order that they had. Returns the number that
  /// each has then, by the one it had; empty where nothing changes. O(faces).
  static std::vector<std::uint32_t> order_faces_by_body(Scene& scene, StopSignal stop);
};

}  // namespace warmfront
