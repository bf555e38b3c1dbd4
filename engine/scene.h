// SPDX-License-Identifier: Apache-2.0
// The model of a scene: triangles, edges, points, incidence and bodies. Immutable once built, so safe to
// share between threads.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/contact.h"
#include "engine/half_space.h"
#include "engine/pair_filters.h"
#include "engine/result.h"
#include "engine/stop.h"

namespace warmfront {

/// Lists of lists in two arrays (compressed rows). Immutable once built.
struct Csr {
  std::vector<std::uint32_t> begin;  ///< rows + 1 offsets into `items`
  std::vector<std::uint32_t> items;

  std::span<const std::uint32_t> operator[](std::size_t row) const {
    return {items.data() + begin[row], items.data() + begin[row + 1]};
  }
  std::size_t rows() const { return begin.empty() ? 0 : begin.size() - 1; }
  std::size_t memory_bytes() const { return (begin.capacity() + items.capacity()) * sizeof(std::uint32_t); }
};

/// How a body moves, which determines what need not be tested (DESIGN 5).
enum class BodyKind : std::uint8_t {
  kDeformable,  ///< any motion; tested against itself unless that is switched off
  kRigid,       ///< as a whole, by poses or positions; never tested against itself
  kStatic,      ///< no motion; never tested against itself or another static body
  kRemoved,     ///< tested against nothing; its vertices and faces keep their numbers, or it has none
};

/// The longest name that a body may have.
inline constexpr std::size_t kMaxNameBytes = 1024;
/// No longer, and UTF-8, as Protocol Buffers have it. `where` names the body in the message.
Status check_name(std::string_view name, const std::string& where);

/// A range of vertices that form a body; or a half-space, a body without any.
struct Body {
  std::string name;  ///< any UTF-8 text, at most kMaxNameBytes
  std::uint32_t first_vertex = 0;
  std::uint32_t vertex_count = 0;
  BodyKind kind = BodyKind::kDeformable;
  bool self_collision = true;  ///< for deformable bodies; the others are never tested against themselves
  /// Two bodies are tested against each other when the group of each has a bit in the mask of the other.
  std::uint32_t group = 1;
  std::uint32_t mask = 0xffffffff;
  /// Finite, >= 0, in the scene's unit: that much of each of its vertices is added to the separation of every
  /// pair that the vertex is in. See SceneDescription::thickness.
  double thickness = 0;
  /// Bodies of two different worlds never meet, so that one scene holds many that know nothing of each other:
  /// a thousand environments, each with the same bodies at the same place. 0: in all of them.
  std::uint32_t world = 0;
  /// The body is this half-space: kStatic or kRigid, its vertex_count 0, without faces and edges. It meets
  /// the vertices of bodies that it may meet, points included, and no other half-space; filters do not apply
  /// to it. A rigid one moves by poses, relative to what is given here: its point is placed by the pose, its
  /// normal by the pose's 3x3 part alone. Frames with all positions leave it where it is.
  std::optional<HalfSpace> half_space = std::nullopt;
  /// Of a rigid body with vertices: from one pose to the next it moves along the screw between them, a
  /// constant twist (screw.h), and not each vertex along a line. It turns by less than half a turn a step: by
  /// half a turn it may go either way round. Positions move it along lines. In tier fast its pairs are tested
  /// as in certified; in exact there is no such body.
  bool screw = false;

  friend bool operator==(const Body&, const Body&) = default;
};

/// No body is thicker, but those that are removed; 0 without any.
double most_thickness(std::span<const Body> bodies);
/// How many move along screws.
std::size_t screw_count(std::span<const Body> bodies);
/// Different worlds, 0 apart, that bodies are in but those that are removed. O(bodies log bodies).
std::size_t world_count(std::span<const Body> bodies);

/// A caller's description of a scene.
struct SceneDescription {
  std::uint32_t vertex_count = 0;
  /// (m, 3) vertex indices, each in [0, vertex_count). A face may repeat an index: it is then a segment or a
  /// point.
  std::vector<std::array<std::int32_t, 3>> faces;
  /// Disjoint ranges that cover all vertices, in order; each face lies within one. The range of a half-space
  /// is empty, and begins where the body before it ends. Empty: everything is deformable, and the connected
  /// components are the bodies.
  std::vector<Body> bodies;
  /// Pairs of bodies, by index, that are not tested against each other.
  std::vector<std::array<std::uint32_t, 2>> excluded_pairs = {};
  /// Pairs of features that do not count.
  PairFilters filters = {};
  /// (n), or empty for none: of each vertex, finite and >= 0, in the scene's unit, besides its body's. A face
  /// or an edge is as thick as the thickest of its vertices, and a pair is in contact, or within the distance
  /// that proximity() asks about, when it comes within that plus the thickness of both. The tiers certified
  /// and exact alone; intersections() go by the triangles themselves.
  std::vector<double> thickness = {};
  /// (k, 2) indices of two different vertices: hair and rods. The scene's edges are these and the faces'
  /// sides, each once, so one that is a face's side too adds nothing. Each lies within one body.
  std::vector<std::array<std::int32_t, 2>> edges = {};
};

/// A body to be added to a scene: its faces and edges number its own vertices from 0.
struct BodyAddition {
  Body body;  ///< first_vertex is ignored
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<std::array<std::int32_t, 2>> edges = {};  ///< as SceneDescription::edges
  std::vector<double> thickness = {};                   ///< as SceneDescription::thickness, of its vertices
};

/// One change of a scene between two frames.
struct AddBody {
  BodyAddition addition;
  std::vector<double> positions;  ///< (k, 3)
};
struct ChangeBody {
  std::uint32_t index;  ///< may be a body added by an earlier change of the same list
  /// Its range is ignored and stays, and so does what it is: a half-space or a mesh. A half-space whose
  /// point, normal or kind changes is from then on where its description says, without a motion.
  Body body;
};
/// Other filters in place of all that there are.
struct ChangeFilters {
  PairFilters filters;  ///< of all vertices, as earlier changes of the same list number them
};
/// Other pairs of bodies that are not tested against each other, in place of all that there are. A pair of
/// which one body is removed stays, and has no effect.
struct ChangeExcludedPairs {
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< may name bodies added by earlier changes of the list
};
/// Other faces and edges for the same vertices of a body, which stay where they are: what is cut, torn, or
/// has edges flipped. Its description stays. Index 0 of a scene without declared bodies is all of it.
struct ReplaceElements {
  std::uint32_t index;  ///< may be a body added or replaced by an earlier change of the same list
  std::vector<std::array<std::int32_t, 3>> faces;  ///< number the body's own vertices from 0
  std::vector<std::array<std::int32_t, 2>> edges = {};
};
/// Another body with the same index, at rest at `positions`: other vertices, faces, edges and description.
/// Also of one that was removed, whose index is used again. Of kind kRemoved, and then without vertices,
/// faces, edges and positions: the body is removed, and its numbers are used again.
///
/// Numbers after a list of changes of which some replace elements or bodies are those of the scene that is
/// created with its bodies, in their order: a body keeps its index, its vertices come after those of the
/// bodies before it, and so do its faces, which keep their order within the body; edges are sorted by their
/// vertices. So a replaced body with other counts shifts the numbers of the bodies after it, and faces that
/// were given with those of different bodies interleaved are ordered by body.
struct ReplaceBody {
  std::uint32_t index;  ///< as ReplaceElements::index
  BodyAddition addition;
  std::vector<double> positions;  ///< (k, 3)
};
using SceneChange =
    std::variant<AddBody, ChangeBody, ChangeFilters, ChangeExcludedPairs, ReplaceElements, ReplaceBody>;
struct ReplacedBodies;

using Face = std::array<std::uint32_t, 3>;
using Edge = std::array<std::uint32_t, 2>;  ///< smaller vertex first, in original numbers

/// The topology of a scene. Non-manifold edges, boundaries, duplicate and degenerate faces, edges of no face
/// and isolated vertices are legal. Edges are sorted by their vertices, so edge ids do not depend on the
/// order of faces. A face (a, a, b) has the sides (a, a) and (a, b), each once: the former is an edge that is
/// a point.
class Scene {
 public:
  /// An empty scene.
  Scene() = default;

  /// Fails with kInvalidArgument, naming the first offender, when an index is out of range, bodies overlap or
  /// leave a gap, a face or an edge joins two bodies, an edge joins a vertex to itself, a group, mask or
  /// excluded pair has no effect, or filters or thickness are of other vertices or out of range.
  /// O((n + m) log m). Throws Stopped when told to stop, as do all functions that take a StopSignal.
  static Result<Scene> create(SceneDescription description, StopSignal stop = {});

  /// The scene with one more body, whose vertices, faces and edges come after all others; existing numbers do
  /// not change. Fails as create() does, and with kFailedPrecondition for a scene without declared bodies,
  /// and one with PairFilters::near_at_rest, for which with_changes() has the body's positions. O(n + m), and
  /// O(k log k) for a body of k faces.
  Result<Scene> with_body(BodyAddition addition) const;
  /// The scene with these changes in order, all or none: as with_body() and with_body_changed(), and with
  /// kInvalidArgument for a change of a removed body. Moves the changes' content out, except positions, which
  /// it looks at for the rest shape alone. `failed`: index of the change that caused the error. O(n + m) at
  /// most once, however many bodies are added or replaced. ReplaceElements and ReplaceBody fail as
  /// with_body(), the former without declared bodies only for another index than 0; ReplaceBody with
  /// kFailedPrecondition, too, where filters name pairs of the vertices that go (change the filters before),
  /// and where these have thickness of their own and the new ones are given none. `replaced`, unless null,
  /// is what no longer is as it was.
  Result<Scene> with_changes(std::span<SceneChange> changes, std::size_t& failed, StopSignal stop = {},
                             ReplacedBodies* replaced = nullptr) const;
  /// The scene with these bodies instead of its own, and no excluded pairs. Fails as create() does.
  Result<Scene> with_bodies(std::vector<Body> bodies, StopSignal stop = {}) const;
  /// The scene with a new description of body `index`, whose range does not change. Fails as create() does.
  Result<Scene> with_body_changed(std::uint32_t index, Body body) const;

  std::uint32_t vertex_count() const { return mesh_->vertex_count; }
  std::uint32_t face_count() const { return static_cast<std::uint32_t>(mesh_->faces.size()); }
  /// Faces and edges of none.
  std::size_t element_count() const { return mesh_->faces.size() + mesh_->lone_edges.size(); }
  std::uint32_t edge_count() const { return static_cast<std::uint32_t>(mesh_->edges.size()); }

  std::span<const Face> faces() const { return mesh_->faces; }
  std::span<const Edge> edges() const { return mesh_->edges; }
  /// The edges (v0 v1), (v1 v2), (v2 v0) of each face; if the face repeats an index, two of them may be the
  /// same.
  std::span<const std::array<std::uint32_t, 3>> face_edges() const { return mesh_->face_edges; }
  /// Faces around a vertex and along an edge, each once, ascending in original numbers.
  const Csr& vertex_faces() const { return mesh_->vertex_faces; }
  const Csr& edge_faces() const { return mesh_->edge_faces; }
  /// Edges of no face, ascending: hair and rods.
  std::span<const std::uint32_t> lone_edges() const { return mesh_->lone_edges; }
  /// Those around a vertex, ascending.
  std::span<const std::uint32_t> lone_edges_of(std::uint32_t vertex) const {
    if (mesh_->lone_edges.empty()) return {};
    return mesh_->vertex_lone_edges[vertex];
  }
  /// Is it of no face and no edge?
  bool is_isolated(std::uint32_t vertex) const {
    return mesh_->vertex_faces[vertex].empty() && lone_edges_of(vertex).empty();
  }
  /// Vertices of no face and no edge, ascending: tested as points against faces; and, where what does not
  /// touch may be in contact, against lone edges and each other.
  std::span<const std::uint32_t> isolated_vertices() const { return mesh_->isolated_vertices; }

  /// The bodies as declared; empty when they default to the connected components.
  std::span<const Body> bodies() const { return bodies_; }
  std::span<const std::array<std::uint32_t, 2>> excluded_pairs() const { return excluded_pairs_; }
  /// What does not count, of all vertices.
  const PairFilters& filters() const;
  /// Of each vertex, besides its body's; empty where none has any.
  std::span<const double> vertex_thickness() const { return mesh_->thickness; }
  /// Of a vertex, with its body's.
  double thickness_of(std::uint32_t vertex) const {
    const double of_body = bodies_.empty() ? 0 : bodies_[mesh_->body_of_vertex[vertex]].thickness;
    return mesh_->thickness.empty() ? of_body : of_body + mesh_->thickness[vertex];
  }
  /// No vertex is thicker; 0 where none is thick. O(bodies).
  double most_thickness() const;
  std::uint32_t body_count() const { return mesh_->body_count; }
  /// The body of each vertex.
  std::span<const std::uint32_t> body_of_vertex() const { return mesh_->body_of_vertex; }

  /// The four vertices of a contact of another kind than edge-face: vertex, then the face's three; else edge
  /// a's two, then edge b's two, where a vertex stands twice in place of an edge. Of a half-space
  /// the vertex three times, as in no other row, then the number of the body that it is.
  std::array<std::uint32_t, 4> vertices_of(const Contact& contact) const;
  /// Of one of kind edge-face: the edge's two, then the face's three.
  std::array<std::uint32_t, 5> edge_face_vertices_of(const Contact& contact) const;

  /// Bytes held, names included.
  std::size_t memory_bytes() const;

 private:
  // Takes over bodies that were checked.
  Status take_bodies(SceneDescription& description, StopSignal stop);
  Status change(std::uint32_t index, Body body);

  friend class Renumbering;  // builds the renumbered Scene
  friend class SceneJoin;
  friend class SceneEdit;
  friend class ChangedScene;

  // Data that do not depend on the bodies' descriptions. Shared by copies of a scene, so that a new
  // description of a body costs nothing that grows with the mesh.
  struct Mesh {
    std::uint32_t vertex_count = 0;
    std::uint32_t body_count = 0;
    std::vector<Face> faces;
    std::vector<Edge> edges;
    std::vector<std::array<std::uint32_t, 3>> face_edges;
    Csr vertex_faces;
    Csr edge_faces;
    std::vector<std::uint32_t> lone_edges;
    Csr vertex_lone_edges;  // without rows where there are none
    std::vector<std::uint32_t> isolated_vertices;
    std::vector<std::uint32_t> body_of_vertex;
    std::vector<double> thickness;  // by vertex; empty: none
    double most_thickness = 0;      // of these
  };
  // For writing: copies the mesh if it is shared.
  Mesh& own_mesh() {
    if (mesh_.use_count() != 1) mesh_ = std::make_shared<Mesh>(*mesh_);
    return *mesh_;
  }
  std::shared_ptr<Mesh> mesh_ = std::make_shared<Mesh>();
  std::vector<Body> bodies_;
  std::size_t name_bytes_ = 0;  // of `bodies_`
  std::vector<std::array<std::uint32_t, 2>> excluded_pairs_;
  std::shared_ptr<const PairFilters> filters_;  // shared by copies; null: none
};

}  // namespace warmfront
