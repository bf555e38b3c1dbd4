// SPDX-License-Identifier: Apache-2.0
// A scene renumbered in the order of its hierarchies, so that neighbours in space are neighbours in memory.
// Changed between steps only, when bodies are added or replaced; read by all threads during a step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/scene.h"
#include "engine/scene/held_bytes.h"
#include "engine/scene/numbers.h"
#include "engine/scene/patches.h"
#include "engine/scene/primitives.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// New numbers for faces and vertices, in the order in which the hierarchies' primitives meet them. Bodies
/// keep their vertex ranges, edges their numbers, features the order of their vertices, and lists of faces
/// their order: so ownership, elementary tests and their bits are the same as in the original scene.
class Renumbering {
 public:
  Renumbering() = default;
  /// `order` holds each primitive of the scene once.
  Renumbering(const Scene& scene, std::span<const Primitive> order) { extend(scene, order); }
  /// Vertices have numbers, those of which these are the given ones; faces get theirs by extend().
  explicit Renumbering(std::vector<GivenVertex> given_vertices);

  /// A range of a numbering that becomes the next part of another. `face_rank` is of the faces that
  /// `numbering` calls given: the number in whose order `range` has them; empty: that is the same.
  struct Slice {
    const Renumbering* numbering = nullptr;
    MeshRange range;
    std::span<const std::uint32_t> face_rank = {};
  };
  /// Of slices one after the other, which are ranges in both numberings. Throws Stopped when told to stop.
  static Renumbering join(std::span<const Slice> slices, StopSignal stop);

  /// Numbers the primitives of the scene's vertices and faces that are not numbered yet. Throws Stopped when
  /// told to stop; truncate() then undoes the partial work.
  void extend(const Scene& scene, std::span<const Primitive> order, StopSignal stop = {});

  /// Appends to `renumbered` what it lacks of the scene, in new numbers and without bodies.
  void extend(const Scene& scene, Scene& renumbered, StopSignal stop = {}) const;

  /// Sizes before an extend(), for truncate().
  struct Extent {
    std::uint32_t vertices = 0;
    std::uint32_t faces = 0;
    std::uint32_t edges = 0;
    std::uint32_t bodies = 0;
  };
  static Extent extent(const Scene& renumbered);
  /// Removes what was appended after `extent`, also after extend() threw.
  void truncate(const Extent& extent, Scene& renumbered) noexcept;
  Patches apply(const Patches& patches) const;
  /// A primitive in its new number.
  Primitive apply(Primitive given) const {
    if (is_segment(given)) return given;  // edges keep their numbers
    if (is_point(given)) return primitive_of_vertex(number_of(renumbered(GivenVertex{vertex_number(given)})));
    return primitive_of_face(number_of(renumbered(GivenFace{face_number(given)})));
  }

  GivenVertex given(NewVertex vertex) const { return given_vertex_[number_of(vertex)]; }
  GivenFace given(NewFace face) const { return given_face_[number_of(face)]; }
  NewVertex renumbered(GivenVertex vertex) const { return new_vertex_[number_of(vertex)]; }
  NewFace renumbered(GivenFace face) const { return new_face_[number_of(face)]; }
  /// The given number of each vertex, by new number.
  std::span<const GivenVertex> given_vertices() const { return given_vertex_; }
  /// A contact between features in new numbers, in given ones.
  Contact given(Contact contact) const {
    const auto vertex = [this](std::uint32_t v) { return number_of(given(NewVertex{v})); };
    using enum ContactKind;
    if (contact.kind == kVertexFace || contact.kind == kVertexEdge || contact.kind == kVertexVertex ||
        contact.kind == kVertexHalfSpace)
      contact.a = vertex(contact.a);
    if (contact.kind == kVertexFace || contact.kind == kEdgeFace)
      contact.b = number_of(given(NewFace{contact.b}));
    if (contact.kind == kVertexVertex) contact.b = vertex(contact.b);
    return contact;
  }

  std::size_t memory_bytes() const { return held_bytes(given_vertex_, given_face_, new_vertex_, new_face_); }

 private:
  std::vector<GivenVertex> given_vertex_;  // by new number
  std::vector<GivenFace> given_face_;
  std::vector<NewVertex> new_vertex_;  // by given number
  std::vector<NewFace> new_face_;
};

}  // namespace warmfront
