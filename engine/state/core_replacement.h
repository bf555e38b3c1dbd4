// SPDX-License-Identifier: Apache-2.0
// A core of which bodies are others: made beside what is in use, which stays as it is until take(). Used by
// one thread; the constructor is parallel inside Workers::run().
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/bvh/topology_replacement.h"
#include "engine/scene/replaced_bodies.h"
#include "engine/state/core.h"

namespace warmfront {

/// What became of a part.
struct PartChange {
  bool is_new = false;
  bool keeps_vertices = false;   ///< likewise: elements alone are others
  bool keeps_hierarchy = false;  ///< of one that is new: its hierarchy is that of what is left of it
  NumberShift shift = {};        ///< of one that is as it was
  /// Of one that keeps its hierarchy, and the numbers of its vertices: by block, does it hold something else?
  std::vector<std::uint8_t> changed_blocks = {};
};

class CoreReplacement {
 public:
  /// `scene` is what the changes make of the core's, `replaced` what is new in it; `positions` by change, of
  /// those that give some; `held` by piece: the hierarchy to keep where it has changed locally, or none. How
  /// that has changed is used up.
  /// Bodies of which the kind changes were settled before. O(scene), of which most is copying, and what the
  /// new parts take. Throws Stopped when told to stop.
  CoreReplacement(Core& core, const Scene& scene, ReplacedBodies& replaced,
                  std::span<const std::span<const double>> positions, std::span<const HeldOrder> held,
                  StopSignal stop);

  /// The core is this one from now on, except for its scene.
  void take(const Scene& scene) noexcept;
  /// By part.
  std::span<PartChange> changes() { return changes_; }

 private:
  std::vector<TopologyReplacement::NewPart> new_parts(const Scene& scene, ReplacedBodies& replaced,
                                                      std::span<const std::span<const double>> positions,
                                                      std::span<const HeldOrder> held, StopSignal stop);
  std::vector<double> gathered(const Scene& scene, std::uint32_t body, StopSignal stop) const;
  void make_motion(const Scene& scene, const ReplacedBodies& replaced, StopSignal stop);
  void make_orphans(StopSignal stop);

  Core& core_;
  CollisionModel model_;
  std::vector<TopologyReplacement::NewPart> new_parts_;
  TopologyReplacement topology_;
  std::optional<SceneMotion::Replacement> motion_;  // where vertices are others
  PairFilter filter_;
  Thickness thickness_;
  Worlds worlds_;
  std::uint64_t excluded_pairs_ = 0;
  std::vector<std::unique_ptr<OrphanBlocks>> orphans_;  // of parts that need others
  std::uint64_t orphans_sum_ = 0;
  std::vector<Run> vertex_runs_;
  std::vector<std::uint8_t> patch_culled_;
  std::vector<PartChange> changes_;
};

}  // namespace warmfront
