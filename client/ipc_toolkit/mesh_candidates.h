// SPDX-License-Identifier: Apache-2.0
// The candidates of one mesh in its caller's numbers: edges and faces as IPC Toolkit has them, in three
// dimensions or two. Of IPC Toolkit's types it knows nothing. Used by one thread at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client/ipc_toolkit/warm_collider.h"

namespace warmfront::ipc_toolkit {

/// A mesh's elements, and of each vertex the patch that it is in: pairs of which all vertices are in one
/// patch, 0 apart, are left out. No patches: empty.
struct Mesh {
  std::size_t vertex_count = 0;
  std::vector<std::array<std::int32_t, 2>> edges;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<std::uint32_t> patches;

  friend bool operator==(const Mesh&, const Mesh&) = default;
};

/// What is asked about: a state, or the linear motion from `start` to `end`, (n, 3) each.
struct MotionOrState {
  std::vector<double> start;
  std::vector<double> end;  ///< empty: a state
  double separation = 0;
};

/// Each function calls take(i, j) once for every pair that it tells of, in a fixed order. None that shares a
/// vertex.
class MeshCandidates {
 public:
  /// Empty for a mesh that a scene cannot be made of with its numbers: an edge that is listed twice or joins
  /// a vertex to itself. std::invalid_argument for an index out of range.
  static std::optional<MeshCandidates> create(Mesh mesh, std::shared_ptr<Workers> workers);

  const Mesh& mesh() const { return mesh_; }

  /// The next functions are about this, until the next call.
  void ask_about(MotionOrState asked) {
    asked_ = std::move(asked);
    elements_.known = std::nullopt;
    points_.known = std::nullopt;
    points_and_edges_.known = std::nullopt;
  }

  template <class Take>  // edge, edge
  void edge_edge(const Take& take) {
    for (const Contact& pair : near_elements()) {
      if (pair.kind != ContactKind::kEdgeEdge) continue;
      const std::int32_t a = edge_of_[pair.a];
      const std::int32_t b = edge_of_[pair.b];
      if (a >= 0 && b >= 0) take(std::min(a, b), std::max(a, b));
    }
  }

  template <class Take>  // face, vertex
  void face_vertex(const Take& take) {
    for (const Contact& pair : near_elements())
      if (pair.kind == ContactKind::kVertexFace)
        take(static_cast<std::int32_t>(pair.b), static_cast<std::int32_t>(pair.a));
  }

  template <class Take>  // vertex, vertex
  void vertex_vertex(const Take& take) {
    if (mesh_.vertex_count == 0) return;
    if (!points_.collider) points_.collider.emplace(scene_of_points(), workers_);
    for (const Contact& pair : near(points_, asked_.start, asked_.end, barely(asked_.separation)))
      take(static_cast<std::int32_t>(pair.a), static_cast<std::int32_t>(pair.b));
  }

  template <class Take>  // edge, vertex
  void edge_vertex(const Take& take) {
    if (mesh_.edges.empty()) return;
    if (!points_and_edges_.collider)
      points_and_edges_.collider.emplace(scene_of_points_and_edges(), workers_);
    const std::vector<double> start = with_edges_vertices(asked_.start);
    const std::vector<double> end = with_edges_vertices(asked_.end);
    for (const Contact& pair : near(points_and_edges_, start, end, barely(asked_.separation))) {
      if (pair.kind != ContactKind::kVertexEdge) continue;
      const std::int32_t edge = lone_edge_of_[pair.b];
      const auto vertex = static_cast<std::int32_t>(pair.a);
      if (vertex != mesh_.edges[edge][0] && vertex != mesh_.edges[edge][1]) take(edge, vertex);
    }
  }

  /// An edge and a face come within the separation only where they meet at the start, or where afterwards an
  /// end of the edge comes so near the face, or the edge a side of the face: two convex sets that do not meet
  /// are nearest at a vertex and a face or at two edges. So these are told, without a test of their own. Not
  /// with patches, which leave out pairs of these kinds that lie in one while the edge does not.
  template <class Take>  // edge, face
  void edge_face(const Take& take);

 private:
  struct Asked {
    std::optional<WarmCollider> collider;
    std::optional<std::span<const Contact>> known;  // what it answered to what is asked about
  };

  MeshCandidates(Mesh mesh, std::shared_ptr<const Scene> scene, std::vector<std::int32_t> edge_of,
                 std::shared_ptr<Workers> workers)
      : mesh_(std::move(mesh)), edge_of_(std::move(edge_of)), workers_(std::move(workers)) {
    elements_.collider.emplace(std::move(scene), workers_);
  }

  // What touches is near by any separation above 0, without which two points, and a point and an edge, are
  // not asked about.
  static double barely(double separation) { return std::max(separation, std::numeric_limits<double>::min()); }

  static std::span<const Contact> near(Asked& asked, std::span<const double> start,
                                       std::span<const double> end, double separation) {
    if (!asked.known)
      asked.known = end.empty() ? asked.collider->near_at(start, separation)
                                : asked.collider->near_on_motion(start, end, separation);
    return *asked.known;
  }
  std::span<const Contact> near_elements() {
    return near(elements_, asked_.start, asked_.end, asked_.separation);
  }

  std::shared_ptr<const Scene> scene_of_points() const;
  std::shared_ptr<const Scene> scene_of_points_and_edges();
  std::vector<double> with_edges_vertices(std::span<const double> positions) const;

  Mesh mesh_;
  std::vector<std::int32_t>
      edge_of_;  // by the scene's edge; -1: a side of a face that the caller does not list
  std::shared_ptr<Workers> workers_;
  MotionOrState asked_;
  Asked elements_;
  Asked points_;
  Asked points_and_edges_;
  std::vector<std::int32_t>
      edge_vertices_;                       // of points_and_edges_, after all n points: those that edges have
  std::vector<std::int32_t> lone_edge_of_;  // by its scene's edge
};

}  // namespace warmfront::ipc_toolkit

#include "client/ipc_toolkit/mesh_candidates_impl.h"
