// SPDX-License-Identifier: Apache-2.0
// Which triangle pair tests which feature pair, so that each is tested exactly once. Immutable during a step;
// safe to share between threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/parallel/move_runs.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/local_change.h"
#include "engine/scene/primitives.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// Procedural ownership over non-adjacent triangle pairs (reference: Tang et al. 2010, Self-CCD; a fixed
/// representative triangle as in Curtis et al. 2008 would lose tests where it is adjacent and another
/// incident face is not):
///   vertex-face (v, f): the first face around v that is not adjacent to f owns it, together with f;
///   edge-edge (e1 < e2): the first pair, in lexicographic order, of a face along e1 and a face along e2 that
///   are not adjacent owns it.
/// A lone edge is the only one along itself, and owns, if it is the first around them, its vertices of no
/// face. Together with the orphan sets this covers every valid pair exactly once.
class Ownership {
 public:
  /// Keeps a reference to the scene, which must outlive this at the same address.
  explicit Ownership(const Scene& scene) : scene_(&scene) { extend(); }
  /// Of a body alone that has changed locally, renumbered; `before` is of the scene that it is `part` of, and
  /// has the same of what is far from the change. Throws Stopped when told to stop.
  Ownership(const Scene& scene, const Ownership& before, const MeshRange& part, const LocalChange& change,
            StopSignal stop);

  class Changed;

  /// Faces that become the next ones of a scene that is put together of such, with their neighbours, whose
  /// numbers are shifted alike. `ownership` null: they are among this one's; with `changed`, those are that
  /// stay of them, and the shift is that of the others.
  struct Slice {
    const Ownership* ownership = nullptr;
    std::uint32_t first_face = 0;
    std::uint32_t end_face = 0;
    NumberShift shift;
    const Changed* changed = nullptr;
  };
  /// Makes room for splice() to so many faces. Throws Stopped when told to stop; nothing has changed then.
  void make_room(std::uint32_t face_count, StopSignal stop);
  /// Is that of the slices from now on; the scene's address stays. `runs`: those that are this one's. O(m).
  void splice(std::span<const Slice> slices, std::span<const Run> runs, std::uint32_t face_count) noexcept;

  /// Adds the faces that were appended to the scene since the last call; truncate() removes them, also after
  /// an exception. O(m). Throws Stopped when told to stop.
  void extend(StopSignal stop = {});
  void truncate(std::uint32_t face_count) noexcept;

  /// Sets of feature pairs of two faces (f, g). Bits 0-2: vertex i of f against g; bits 3-5: vertex i of g
  /// against f; bits 6 + 3 i + j: edge i of f against edge j of g.
  struct Candidates {
    std::uint32_t owned;    ///< certainly owned
    std::uint32_t perhaps;  ///< owned if owns() returns true
  };
  /// The feature pairs owned by the non-adjacent faces (f, g). Cheap; owns() walks the incident faces.
  Candidates candidates(std::uint32_t f, std::uint32_t g) const;
  /// The same of a face or lone edge and a lone edge, whose vertices 0 and 1 are the first two, and whose
  /// edge 0 runs between these: owned.
  std::uint32_t owned_with_segment(Primitive p, EdgeId lone_edge) const;
  /// Does (f, g) own the feature pair of this bit, one of candidates(f, g).perhaps?
  bool owns(std::uint32_t f, std::uint32_t g, int bit) const;
  /// Do the non-adjacent faces (f, g) own edge i of f against g: is f the first face along it that is not
  /// adjacent to g? Every edge and face without a common vertex have one such pair, unless all faces along
  /// the edge are adjacent to the face.
  bool owns_edge_face(std::uint32_t f, int i, std::uint32_t g) const;

  std::size_t memory_bytes() const { return held_bytes(records_, signatures_); }

 private:
  // A set of vertices as a 256-bit Bloom filter with one hash: "certainly disjoint" or "perhaps not".
  using Bloom = std::array<std::uint64_t, 4>;

  struct Record {
    Face vertices;
    // Bits 0-2: first face of vertex i; bits 3-5: first face of edge i; bits 6-11: the same corner or side
    // does not occur earlier in the face. The latter are all set unless the face repeats an index; a
    // repetition owns nothing.
    std::uint32_t first_bits;
    Face first_of_vertex;  // the first face around each vertex
    Face first_of_edge;    // the first face along each edge
    Bloom vertex_ring;     // vertices of the faces around the three vertices
    Bloom edge_ring;       // vertices of the faces along the three edges
  };

  class Recorder;

  void take(const Changed& changed, const NumberShift& shift) noexcept;
  static void shift(Record& record, std::uint64_t& signature, const NumberShift& by);
  bool perhaps_near(const Record& f, const Record& g) const;
  bool perhaps_adjacent(std::uint32_t f, std::uint32_t g) const {
    return (signatures_[f] & signatures_[g]) != 0;
  }
  bool are_adjacent(std::uint32_t f, std::uint32_t g) const;
  bool owns_vf(std::uint32_t owner, std::uint32_t v, std::uint32_t face) const;
  bool owns_ee(std::uint32_t f, EdgeId e1, std::uint32_t g, EdgeId e2) const;

  const Scene* scene_;
  std::vector<Record> records_;
  std::vector<std::uint64_t> signatures_;  // a face's three vertices as a 64-bit Bloom filter
};

/// Of a body that has changed locally, of which the faces that stay keep their order: what is made anew, so
/// that all else is changed where it is.
class Ownership::Changed {
 public:
  /// `scene` is the body alone, renumbered, which was `part` of another; `change` outlives this. O(n), little
  /// more than the change takes. Throws Stopped when told to stop.
  Changed(const Scene& scene, const MeshRange& part, const LocalChange& change, StopSignal stop);

 private:
  friend class Ownership;

  const MeshRange part_;
  const LocalChange& change_;
  std::vector<std::uint32_t> faces_;  // that are made anew
  std::vector<Record> records_;       // of these
  std::vector<std::uint64_t> signatures_;
};

}  // namespace warmfront
