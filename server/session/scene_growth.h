// SPDX-License-Identifier: Apache-2.0
// What changes make of a scene's size, told before they are carried out. Thread-safe.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "engine/scene.h"
#include "server/fault.h"
#include "server/session/limits.h"

namespace warmfront::server {

/// Which of the limits on vertices and triangles the scene meets with the changes, if it does. Asked in the
/// changes' turn and not when they arrive: others may be on their way. How long filters are follows from the
/// scene's vertices, which the collider checks, but for their pairs, which are bounded by what a session may
/// hold.
std::optional<Fault> too_large_with(const Scene& scene, std::span<const SceneChange> changes,
                                    const Limits& limits);

/// What estimate_bytes() needs besides a scene's size.
struct ScenePrice {
  std::size_t bytes_per_number;  ///< of a position
  bool explain;                  ///< a second collider runs beside the first
  const Limits& limits;
};
/// The bytes that the changes bring, as estimate_bytes() estimates them.
std::size_t growth_with(const Scene& scene, std::span<const SceneChange> changes, const ScenePrice& price);

/// The same refusal, which says so where bodies that were removed hold a good part of the scene.
Fault with_removed(Fault refusal, const Scene& scene);

}  // namespace warmfront::server
