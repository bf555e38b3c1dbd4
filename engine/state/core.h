// SPDX-License-Identifier: Apache-2.0
// What a collider keeps between steps whatever its bounds: the scene, its motion, and what was made of both.
// Used by one thread at a time; read by all threads during a step.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/bvh/topology.h"
#include "engine/contact.h"
#include "engine/elementary/keep_distance.h"
#include "engine/frame.h"
#include "engine/motion/arcs.h"
#include "engine/motion/commit_room.h"
#include "engine/motion/scene_motion.h"
#include "engine/narrow_phase/orphan_blocks.h"
#include "engine/options.h"
#include "engine/parallel/unwritten_list.h"
#include "engine/scene/collision_model.h"
#include "engine/scene/pair_filter.h"
#include "engine/scene/thickness.h"
#include "engine/scene/worlds.h"
#include "engine/state/kept_window.h"
#include "engine/state/rigid_parts.h"

namespace warmfront {

/// A question's answer, pair by pair.
struct FoundPairs {
  UnwrittenList<Contact> contacts;
  std::vector<ContactGeometry> geometry;   ///< of these, when asked for
  std::vector<ClosestPair> closest_pairs;  ///< of these, when they are reduced
  std::vector<double> vertex_distances;    ///< by given vertex, instead of these
  std::vector<double> world_tois;          ///< by world: see StepResult

  std::size_t memory_bytes() const {
    return contacts.capacity() * sizeof(Contact) + geometry.capacity() * sizeof(ContactGeometry) +
           closest_pairs.capacity() * sizeof(ClosestPair) +
           (vertex_distances.capacity() + world_tois.capacity()) * sizeof(double);
  }
};

struct Core {
  /// At rest at `positions`, which were checked. `modelled` is the scene itself, or the same with bodies
  /// found in it. Parallel. Throws Stopped when told to stop.
  Core(std::shared_ptr<const Scene> scene, const Scene& modelled, const Positions& positions,
       const ColliderOptions& options, std::shared_ptr<Workers> workers, StopSignal stop = {});

  /// Makes what the model that a scene describes needs; nothing of this is in use before take(). Parallel;
  /// call it inside Workers::run(). `given` is the scene in the numbers first given; `extended`: the topology
  /// is another one than take() last knew. Throws Stopped when told to stop.
  struct Parts {
    CollisionModel model;
    PairFilter filter;
    Thickness thickness;
    Worlds worlds;
    std::uint64_t excluded_pairs;
    std::vector<std::unique_ptr<OrphanBlocks>> orphans;  // of parts that need them and have none
    std::uint64_t topology_sum;
    std::uint64_t orphans_sum;
  };
  Parts make_parts(const Scene& modelled, const Scene& given, bool extended, StopSignal stop);
  void take(Parts parts) noexcept;
  /// What these filters leave out, in the numbers of the topology, of parts as a model has them.
  PairFilter make_filter(const PairFilters& filters, const CollisionModel& of_parts, StopSignal stop) const;
  /// The same, and how thick everything is, of parts with these ranges of a scene renumbered so.
  static PairFilter make_filter(const PairFilters& filters, const CollisionModel& of_parts,
                                std::span<const FeatureRange> ranges, const Renumbering& numbering,
                                const Scene& renumbered, StopSignal stop);
  static Thickness make_thickness(const Scene& given, std::span<const FeatureRange> ranges,
                                  const Renumbering& numbering, StopSignal stop);

  /// Is the part one of those that are near themselves? Such a part neither waits nor moves by poses.
  bool tests_itself(PartId part) const { return model.self_collision(part) && !rigid_parts.rigid(part); }

  /// Bytes held, the scene included.
  std::size_t memory_bytes() const;

  std::shared_ptr<const Scene> scene;  // in the numbers first given; all below it is in those of topology
  ColliderOptions options;             // of the question in hand; between questions the session's
  KeepDistance keep;                   // of the question in hand: where this or `room` is asked,
                                       // options.min_separation is the widest separation of any pair
  CommitRoom room;                     // likewise
  KeptWindow window;                   // of the question in hand, where it keeps distances
  double asked_separation = 0;         // the minimum separation of the last question
  std::shared_ptr<Workers> workers;
  SceneMotion motion;
  CollisionModel model;
  PairFilter filter;
  Thickness thickness;
  Arcs arcs;  // of the motion that was begun last
  Worlds worlds;
  std::uint64_t excluded_pairs = 0;
  std::unique_ptr<Topology> topology;
  RigidParts rigid_parts;
  std::vector<std::unique_ptr<OrphanBlocks>> orphans;  // by part; null where it is not tested against itself
  std::vector<PointBounds> vertex_bounds;
  std::vector<std::uint8_t> patch_culled;
  // Of the last step or trial, and of the last question of proximity: a commit counts the trial's.
  FoundPairs met;
  FoundPairs near;
  FoundPairs& found() { return options.pair_test == PairTest::kMotion ? met : near; }
  std::uint64_t topology_sum = 0;  // see topology_checksum()
  std::uint64_t orphans_sum = 0;   // see orphans_checksum()
  std::uint64_t checksum() const { return topology_sum + orphans_sum; }
};

/// What grows when bodies are added, and shrinks back to what it was unless these are kept.
class Growth {
 public:
  explicit Growth(Core& core)
      : core_(core),
        topology_(core.topology->extent()),
        parts_(core.motion.part_count()),
        vertices_(core.scene->vertex_count()) {}
  ~Growth() {
    if (kept_) return;
    core_.motion.truncate(parts_, vertices_);
    core_.topology->truncate(topology_);
  }
  Growth(const Growth&) = delete;
  Growth& operator=(const Growth&) = delete;

  void keep() noexcept { kept_ = true; }

 private:
  Core& core_;
  const Topology::Extent topology_;
  const std::uint32_t parts_;
  const std::uint32_t vertices_;
  bool kept_ = false;
};

/// Row-major (n, 3), converted exactly. Throws Stopped when told to stop.
std::vector<double> to_doubles(const Positions& positions, StopSignal stop = {});

}  // namespace warmfront
