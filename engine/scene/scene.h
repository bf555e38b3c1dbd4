// SPDX-License-Identifier: Apache-2.0
// What is modelled: triangles, edges, incidence and bodies. Immutable once built, so free to share between
// threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/contact.h"
#include "engine/result.h"
#include "engine/scene/csr.h"

namespace warmfront {

/// How a body moves. All kinds are tested as deformable until the scene modelling uses them; they are kept
/// and reported.
enum class BodyKind : std::uint8_t { kDeformable, kRigid, kStatic };

/// A range of vertices that belong together.
struct Body {
  std::string name;
  std::uint32_t first_vertex = 0;
  std::uint32_t vertex_count = 0;
  BodyKind kind = BodyKind::kDeformable;
};

/// What a caller says of a scene.
struct SceneDescription {
  std::uint32_t vertex_count = 0;
  /// (m, 3) vertex indices, each in [0, vertex_count).
  std::vector<std::array<std::int32_t, 3>> faces;
  /// Disjoint ranges that cover all vertices, in order. Empty: the connected components of the faces.
  std::vector<Body> bodies;
};

using Face = std::array<std::uint32_t, 3>;
using Edge = std::array<std::uint32_t, 2>;  ///< smaller vertex first, in the numbers first given

/// The topology of a scene. Non-manifold edges, boundaries, duplicate and degenerate faces and isolated
/// vertices are legal. Edges are sorted by their vertices, so edge ids do not depend on the order of faces.
class Scene {
 public:
  /// Fails with kInvalidArgument, naming the first offender, when an index is out of range or repeated within
  /// a face, or when bodies overlap or leave a gap. O((n + m) log m).
  static Result<Scene> create(SceneDescription description);

  std::uint32_t vertex_count() const { return vertex_count_; }
  std::uint32_t face_count() const { return static_cast<std::uint32_t>(faces_.size()); }
  std::uint32_t edge_count() const { return static_cast<std::uint32_t>(edges_.size()); }

  std::span<const Face> faces() const { return faces_; }
  std::span<const Edge> edges() const { return edges_; }
  /// The edges (v0 v1), (v1 v2), (v2 v0) of each face.
  std::span<const std::array<std::uint32_t, 3>> face_edges() const { return face_edges_; }
  /// Faces around a vertex and along an edge, ascending in the numbers first given.
  const Csr& vertex_faces() const { return vertex_faces_; }
  const Csr& edge_faces() const { return edge_faces_; }
  /// Vertices of no face, ascending: they are tested as points.
  std::span<const std::uint32_t> isolated_vertices() const { return isolated_vertices_; }

  /// The bodies as given; empty when they default to the connected components.
  std::span<const Body> bodies() const { return bodies_; }
  std::uint32_t body_count() const { return body_count_; }
  /// The body of each vertex.
  std::span<const std::uint32_t> body_of_vertex() const { return body_of_vertex_; }

  /// The four vertices of a contact: vertex, then the face's three; or edge a's two, then edge b's two.
  std::array<std::uint32_t, 4> vertices_of(const Contact& contact) const;

  /// Bytes held.
  std::size_t memory_bytes() const;

 private:
  friend class Renumbering;  // makes another Scene of this one
  Scene() = default;

  std::uint32_t vertex_count_ = 0;
  std::uint32_t body_count_ = 0;
  std::vector<Face> faces_;
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 3>> face_edges_;
  Csr vertex_faces_;
  Csr edge_faces_;
  std::vector<std::uint32_t> isolated_vertices_;
  std::vector<Body> bodies_;
  std::vector<std::uint32_t> body_of_vertex_;
};

}  // namespace warmfront
