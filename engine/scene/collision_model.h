// SPDX-License-Identifier: Apache-2.0
// Which bodies may meet, from their groups, masks, worlds and kinds. Immutable once built; safe to share
// between threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <unordered_set>
#include <vector>

#include "engine/scene.h"
#include "engine/scene/part_id.h"

namespace warmfront {

/// Bodies, as parts of the hierarchy. A scene that declares no bodies is one part, tested against itself.
class CollisionModel {
 public:
  explicit CollisionModel(const Scene& scene, StopSignal stop = {});

  /// The combined properties of a set of parts: the union of groups and masks, the range of worlds, and
  /// whether any part moves. Two sets that cannot meet contain no two parts that may meet.
  struct Set {
    std::uint32_t groups = 0;
    std::uint32_t masks = 0;
    bool moving = false;
    bool in_all_worlds = true;             // or any of them
    std::uint32_t first_world = kNoWorld;  // of the others
    std::uint32_t last_world = 0;

    static constexpr std::uint32_t kNoWorld = 0xffffffff;

    void put_in(std::uint32_t world) {
      if (world == 0) return;
      in_all_worlds = false;
      first_world = last_world = world;
    }

    void add(const Set& other) {
      groups |= other.groups;
      masks |= other.masks;
      moving |= other.moving;
      in_all_worlds |= other.in_all_worlds;
      first_world = std::min(first_world, other.first_world);
      last_world = std::max(last_world, other.last_world);
    }
    bool share_a_world(const Set& other) const {
      return in_all_worlds || other.in_all_worlds ||
             (first_world <= other.last_world && other.first_world <= last_world);
    }
    bool may_meet(const Set& other) const {
      return (groups & other.masks) != 0 && (other.groups & masks) != 0 && (moving || other.moving) &&
             share_a_world(other);
    }
  };

  std::uint32_t part_count() const { return static_cast<std::uint32_t>(sets_.size()); }
  PartId end_part() const { return PartId{part_count()}; }  ///< after the last
  /// Of one part; a removed part is empty and meets nothing.
  const Set& set_of(PartId part) const { return sets_[number_of(part)]; }
  bool is_static(PartId part) const { return !sets_[number_of(part)].moving; }
  bool is_removed(PartId part) const { return sets_[number_of(part)].groups == 0; }
  bool self_collision(PartId part) const { return self_[number_of(part)] != 0; }
  /// 0: in all of them.
  std::uint32_t world_of(PartId part) const { return sets_[number_of(part)].last_world; }
  /// A part that is a half-space: without a mesh, and to the hierarchies as one that is removed.
  struct HalfSpaceOf {
    PartId part;
    Set set;
    HalfSpace at_rest;     ///< at the identity pose
    double thickness = 0;  ///< scene units
  };
  /// By part, of those that are not removed.
  std::span<const HalfSpaceOf> half_spaces() const { return half_spaces_; }
  /// The parts that move along the screw between two poses, in order.
  std::span<const PartId> screws() const { return screws_; }
  /// Are the vertices of a part tested against the half-space?
  bool may_meet(const HalfSpaceOf& half_space, PartId part) const {
    return sets_[number_of(part)].may_meet(half_space.set) && !is_excluded(half_space.part, part);
  }
  /// Are two parts tested against each other (p != q), or a part against itself (p == q)?
  bool may_meet(PartId p, PartId q) const;
  /// Number of pairs of parts that the model excludes, including a part with itself.
  std::uint64_t excluded_pairs(StopSignal stop = {}) const;
  std::size_t memory_bytes() const;

 private:
  bool is_excluded(PartId p, PartId q) const;

  std::vector<HalfSpaceOf> half_spaces_;
  std::vector<PartId> screws_;
  std::vector<Set> sets_;
  std::vector<std::uint8_t> self_;
  std::unordered_set<std::uint64_t> excluded_;  // smaller number in the upper half
};

}  // namespace warmfront
