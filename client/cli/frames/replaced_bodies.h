// SPDX-License-Identifier: Apache-2.0
// What differs between two scenes of an input whose topology changes, as changes of a session. Pure functions.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/frame.h"
#include "engine/scene.h"

namespace warmfront::client {

/// A body with another mesh, whose vertices are `first_vertex` and on of the new scene.
struct ReplacedBody {
  std::uint32_t index;
  BodyAddition with;
  std::uint32_t first_vertex;
};

/// The bodies whose vertices' number, faces, edges or thickness are others in `to`. Nothing where the scenes
/// declare no bodies, or differ in more than that: in which bodies there are and what they are said to be, or
/// in filters; and where filters name vertices.
std::optional<std::vector<ReplacedBody>> replaced_bodies(const SceneDescription& from,
                                                         const SceneDescription& to);

/// Rows [first, first + count) of positions.
Positions rows_of(const Positions& positions, std::uint32_t first, std::uint32_t count);

}  // namespace warmfront::client
