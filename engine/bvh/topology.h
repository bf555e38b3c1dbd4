// SPDX-License-Identifier: Apache-2.0
// All data derived from a scene's connectivity before its first step. Changed between steps only, when bodies
// are added or replaced; read by all threads during a step.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/scene.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "engine/scene/part_id.h"
#include "engine/scene/patches.h"
#include "engine/scene/renumbering.h"
#include "engine/stop.h"

namespace warmfront {

/// A part has its own hierarchy: a declared body, or all of a scene that declares none. No face and no orphan
/// pair joins two parts.
struct PartTopology {
  FeatureRange features;
  std::uint32_t first_face = 0;  ///< in new numbers, as `end_face`
  std::uint32_t end_face = 0;
  TreeShape shape;
  std::vector<Primitive> order;                  ///< of the primitives, for the first hierarchy
  Orphans orphans;                               ///< only where the part is tested against itself
  std::shared_ptr<const SharedVertices> shared;  ///< in that order; likewise
  bool has_adjacent = false;                     ///< `orphans` and `shared` were found

  MeshRange range() const { return {features, first_face, end_face}; }
  /// The same where its numbers begin elsewhere.
  void shift(const NumberShift& by) noexcept;
};

/// Rings of faces in a patch whose self-collision the normal cone can exclude: few enough to be flat often,
/// enough that most near pairs of faces lie in one patch.
inline constexpr int kPatchRings = 3;

/// Numbered in the order of the first hierarchies (see Renumbering), except edges. Not movable: its parts
/// refer to each other.
class Topology {
 public:
  /// Orders the primitives by their positions at the end of `motion` (in given numbers). With `cones`,
  /// finds the patches for the normal cone test. Parallel; call it inside Workers::run(). Throws Stopped when
  /// told to stop, as do all functions that take a StopSignal.
  Topology(const Scene& given, const Motion& motion, std::uint32_t leaf_size, bool cones,
           StopSignal stop = {});
  Topology(const Topology&) = delete;
  Topology& operator=(const Topology&) = delete;

  /// Adds the body that was appended to the scene; its motion is in given numbers. Its faces are in no
  /// patch. Parallel and stoppable like the constructor.
  void extend(const Scene& given, const Motion& motion, StopSignal stop = {});

  /// Sizes before an extend(), for truncate().
  struct Extent {
    std::size_t parts;
    Renumbering::Extent scene;
    std::uint64_t adjacent_pairs;
  };
  Extent extent() const { return {parts.size(), Renumbering::extent(scene), adjacent_pairs}; }
  /// Removes what was appended after `extent`, also after extend() threw.
  void truncate(const Extent& extent) noexcept;

  /// Finds the orphans and shared vertices of a part that is tested against itself. They are kept; after an
  /// exception they are unset.
  void need_adjacent(PartId part, StopSignal stop = {});

  std::size_t memory_bytes() const;

 private:
  void add_parts(const Scene& given, const Motion& motion, StopSignal stop);

  friend class TopologyReplacement;

  const std::uint32_t leaf_size_;
  const bool cones_;

 public:
  std::deque<PartTopology> parts;  ///< with stable addresses
  Renumbering numbering;
  Scene scene;
  Patches patches;  ///< empty without cones, except of_face
  Ownership ownership;
  std::uint64_t adjacent_pairs = 0;  ///< of faces
};

}  // namespace warmfront
