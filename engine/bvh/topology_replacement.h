// SPDX-License-Identifier: Apache-2.0
// A topology of which parts are others: made beside the one in use, which stays as it is until take(). Used
// by one thread; the constructor is parallel inside Workers::run().
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/bvh/kept_order.h"
#include "engine/bvh/topology.h"
#include "engine/scene/replaced_bodies.h"

namespace warmfront {

class TopologyReplacement {
 public:
  /// Of a part that is not as it was: what its hierarchy is made by.
  struct NewPart {
    const ReplacedBodies::Piece* piece = nullptr;
    std::function<std::vector<double>()> positions;  ///< in the order that the user gave its vertices
    std::vector<GivenVertex>
        given_vertices;  ///< where it keeps them: theirs by new number, from 0; else empty
    bool tests_itself = false;
    /// Where it keeps its vertices and has changed locally, from what the topology has: that is used up.
    LocalChange* change = nullptr;
    HeldOrder held = {};  ///< where it keeps its vertices: the hierarchy to keep if it has changed locally
  };

  /// `parts` by index, with those that are appended; `face_rank` as ReplacedBodies says. What is as it was
  /// is copied, so all this takes O(scene), and the new parts what they take. Throws Stopped when told to
  /// stop.
  TopologyReplacement(Topology& topology, std::span<const NewPart> parts,
                      std::span<const std::uint32_t> face_rank, StopSignal stop);
  ~TopologyReplacement();
  TopologyReplacement(const TopologyReplacement&) = delete;
  TopologyReplacement& operator=(const TopologyReplacement&) = delete;

  std::uint32_t part_count() const { return static_cast<std::uint32_t>(ranges_.size()); }
  /// By part: where it is from take() on.
  std::span<const MeshRange> ranges() const { return ranges_; }
  bool is_new(PartId part) const { return new_of_[number_of(part)] != kOld; }
  /// Of a new part: has it, of a hierarchy that was given, what is left in the blocks that it was in?
  bool keeps_hierarchy(PartId part) const { return made_[new_of_[number_of(part)]]->keeps_hierarchy; }
  /// By block of such a hierarchy: does it hold something else? To be taken once.
  std::vector<std::uint8_t> changed_blocks(PartId part) {
    return std::move(made_[new_of_[number_of(part)]]->changed_blocks);
  }
  /// Of a part that is as it was.
  NumberShift shift(PartId part) const { return shifts_[number_of(part)]; }
  /// Of new parts, where they test themselves, in numbers of their own.
  const Orphans& orphans(PartId part) const { return made_[new_of_[number_of(part)]]->part.orphans; }
  std::uint64_t orphans_sum(PartId part, StopSignal stop) const;
  /// Of new parts: their own numbers.
  const Renumbering& numbering_of(PartId part) const { return made_[new_of_[number_of(part)]]->numbering; }
  const Renumbering& numbering() const { return numbering_; }
  const Scene& scene() const { return scene_; }
  std::size_t patch_count() const { return patches_.count(); }

  /// The topology is this one from now on; parts keep their addresses.
  void take() noexcept;

 private:
  static constexpr std::uint32_t kOld = 0xffffffff;

  // A part in numbers of its own.
  struct Made {
    PartTopology part;
    Renumbering numbering;
    Scene scene;
    std::unique_ptr<Ownership> ownership;  // or what changes of it
    std::optional<LocalChange> change;
    std::optional<Ownership::Changed> owners_changed;
    Patches patches;
    std::uint64_t more_adjacent_pairs = 0;  // than the part had before, modulo 2^64
    bool keeps_hierarchy = false;
    std::vector<std::uint8_t> changed_blocks;
  };
  std::uint64_t more_adjacent_pairs(const Made& made, std::uint32_t index, StopSignal stop) const;
  void make(const NewPart& from, Made& made, StopSignal stop) const;
  void place_parts();
  void join(std::span<const std::uint32_t> face_rank, StopSignal stop);

  Topology& topology_;
  const std::size_t parts_before_;
  std::vector<std::unique_ptr<Made>> made_;
  std::vector<std::uint32_t> new_of_;  // by part: which of made_, or kOld
  std::vector<MeshRange> ranges_;
  std::vector<NumberShift> shifts_;
  Renumbering numbering_;
  Scene scene_;
  std::vector<Ownership::Slice> ownerships_;
  std::vector<Run> face_runs_;
  Patches patches_;
  std::uint64_t adjacent_pairs_ = 0;
  bool taken_ = false;
};

}  // namespace warmfront
