// SPDX-License-Identifier: Apache-2.0
// An edge and a face that meet, in words. Pure functions, but for the warning.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "client/io/mesh.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::client {

/// The edge's two vertices, then the face's three.
using EdgeFace = std::array<std::uint32_t, 5>;

/// Where a pair is: the middle of the edge, which is not far.
std::array<double, 3> place_of(const EdgeFace& pair, const Positions& at);

/// "edge 3-4 meets face 0-1-2 near (0.25, 0.25, 0)".
std::string describe(const EdgeFace& pair, const Positions& at);

/// Says on stderr if edges meet faces in frame `number`, which is at `positions`, and where the first does:
/// what begins tangled has contacts from its start on. Of very many it says only that. Asks in this process,
/// with one thread per core. Fails as Scene::create() and Collider::create() do.
Status warn_if_tangled(const SceneDescription& scene, const Positions& positions, std::uint64_t number);

}  // namespace warmfront::client
