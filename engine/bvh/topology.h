// SPDX-License-Identifier: Apache-2.0
// All that is made of a scene's connectivity before its first step. Changed between steps only, when a body
// is added; read by all threads during a step.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/scene.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "engine/scene/patches.h"
#include "engine/scene/renumbering.h"
#include "engine/stop.h"

namespace warmfront {

/// A part has a hierarchy of its own: a declared body, or all of a scene that declares none. No face and no
/// orphan pair joins two parts.
struct PartTopology {
  FeatureRange features;
  TreeShape shape;
  std::vector<Primitive> order;                  ///< of the primitives, for the first hierarchy
  Orphans orphans;                               ///< only where the part is tested against itself
  std::shared_ptr<const SharedVertices> shared;  ///< in that order; the same
  bool has_adjacent = false;                     ///< both were found
};

/// In numbers along the first hierarchies (see Renumbering), edges apart. Its parts refer to each other, so
/// it stays where it was made.
class Topology {
 public:
  /// Orders the primitives by where `motion` (in the numbers first given) ends. With `cones`, finds the
  /// patches for the normal cone test. Parallel; call it inside Workers::run(). Throws Stopped when told to
  /// stop, as all that takes a StopSignal.
  Topology(const Scene& given, const Motion& motion, std::uint32_t leaf_size, bool cones,
           StopSignal stop = {});
  Topology(const Topology&) = delete;
  Topology& operator=(const Topology&) = delete;

  /// Takes the body that was appended to the scene; its motion is in the numbers first given. Its faces are
  /// in no patch. As the constructor.
  void extend(const Scene& given, const Motion& motion, StopSignal stop = {});

  /// What extend() appends to.
  struct Extent {
    std::size_t parts;
    Renumbering::Extent scene;
    std::uint64_t adjacent_pairs;
  };
  Extent extent() const { return {parts.size(), Renumbering::extent(scene), adjacent_pairs}; }
  /// Takes back what was appended since, also where extend() ended by an exception.
  void truncate(const Extent& extent) noexcept;

  /// Finds the orphans of a part that is tested against itself, and who shares vertices. They stay; after an
  /// exception they are not known.
  void need_adjacent(std::uint32_t part, StopSignal stop = {});

  std::size_t memory_bytes() const;

 private:
  void add_parts(const Scene& given, const Motion& motion, StopSignal stop);

  const std::uint32_t leaf_size_;

 public:
  std::deque<PartTopology> parts;  ///< each stays where it is
  Renumbering numbering;
  Scene scene;
  Patches patches;  ///< empty without cones; of_face is filled all the same
  Ownership ownership;
  std::uint64_t adjacent_pairs = 0;  ///< of faces
};

}  // namespace warmfront
