// SPDX-License-Identifier: Apache-2.0
// The hierarchy of what is left of a body that has changed locally. A pure function.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/bvh/shared_vertices.h"
#include "engine/bvh/tree_shape.h"
#include "engine/scene.h"
#include "engine/scene/local_change.h"
#include "engine/scene/numbers.h"
#include "engine/scene/primitives.h"
#include "engine/scene/scene_join.h"
#include "engine/stop.h"

namespace warmfront {

/// A hierarchy's primitives as it holds them, which something else keeps.
struct HeldOrder {
  TreeShape shape;
  std::span<const Primitive> order;
  std::shared_ptr<const SharedVertices> shared;  ///< of these, or null
};
struct KeptOrder {
  TreeShape shape;
  std::vector<Primitive> order;
  std::vector<std::uint8_t> changed;  ///< by block: does it hold something else?
  /// By face in that order: which of the body it was, renumbered, or LocalChange::kNone.
  std::vector<std::uint32_t> face_before;
};

/// `held` is of the hierarchy of the body when it was `part` of the scene `before`, renumbered by
/// `numbering`; `alone` is the body with its other elements, and `change` what find_local_change() says of
/// it, as given. Primitives that are left stay in their blocks, where they can in their places; those that
/// are new go where fill_blocks() says; a block of which nothing is left takes one from near by. Nothing
/// where there is no room within kReach blocks, or where less than half of all room is used. Given numbers of
/// `alone`. O(primitives). Throws Stopped when told to stop.
std::optional<KeptOrder> keep_order(const HeldOrder& held, const Scene& before, const Renumbering& numbering,
                                    const MeshRange& part, const Scene& alone, const LocalChange& change,
                                    StopSignal stop);

}  // namespace warmfront
