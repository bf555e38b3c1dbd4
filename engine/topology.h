// SPDX-License-Identifier: Apache-2.0
// All that is made once of a scene's connectivity before its first step. Immutable once made; free to share.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "engine/scene/patches.h"
#include "engine/scene/renumbering.h"
#include "engine/scene/scene.h"

namespace warmfront {

/// In numbers along the first hierarchy (see Renumbering), edges apart. Its parts refer to each other, so it
/// stays where it was made.
class Topology {
 public:
  /// Orders the primitives by where `motion` (in the numbers first given) ends. With `cones`, finds the
  /// patches for the normal cone test. Parallel; call it inside Workers::run().
  Topology(const Scene& given, const Motion& motion, const TreeShape& shape, bool cones);
  Topology(const Topology&) = delete;
  Topology& operator=(const Topology&) = delete;

  std::size_t memory_bytes() const;

 private:
  std::vector<std::uint32_t> given_order_;

 public:
  const Renumbering numbering;
  const std::vector<std::uint32_t> first_order;  ///< of the primitives, for the first hierarchy
  const Scene scene;
  const Patches patches;  ///< empty without cones; of_face is filled all the same
  const Ownership ownership;
  const Orphans orphans;
  const std::uint64_t adjacent_pairs;  ///< of faces
};

}  // namespace warmfront
