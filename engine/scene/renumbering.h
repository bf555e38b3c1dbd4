// SPDX-License-Identifier: Apache-2.0
// A scene renumbered along its hierarchy, so that what is near in space is near in memory. Immutable once
// built; free to share.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/contact.h"
#include "engine/scene/patches.h"
#include "engine/scene/scene.h"

namespace warmfront {

/// New numbers for faces and vertices, in the order in which the hierarchy's primitives meet them. Edges keep
/// their numbers, features keep the order of their vertices, and lists of faces their order: so owners,
/// elementary tests and their bits are those of the scene as given.
class Renumbering {
 public:
  /// `order` holds each primitive of the scene once: faces, then isolated vertices, numbered as in Bvh.
  Renumbering(const Scene& scene, std::span<const std::uint32_t> order);

  /// The same scene in new numbers, without the bodies' ranges, which are ranges no more.
  Scene apply(const Scene& scene) const;
  Patches apply(const Patches& patches) const;
  /// The primitives' order in new numbers.
  std::vector<std::uint32_t> apply(const Scene& scene, std::span<const std::uint32_t> order) const;

  /// Original number of each vertex, by new number.
  std::span<const std::uint32_t> vertices() const { return original_vertex_; }
  /// A contact in original numbers.
  Contact original(Contact contact) const {
    if (contact.kind == ContactKind::kVertexFace) {
      contact.a = original_vertex_[contact.a];
      contact.b = original_face_[contact.b];
    }
    return contact;
  }

  std::size_t memory_bytes() const {
    return 2 * (original_vertex_.size() + original_face_.size()) * sizeof(std::uint32_t);
  }

 private:
  std::vector<std::uint32_t> original_vertex_;  // by new number
  std::vector<std::uint32_t> original_face_;
  std::vector<std::uint32_t> new_vertex_;  // by original number
  std::vector<std::uint32_t> new_face_;
};

}  // namespace warmfront
