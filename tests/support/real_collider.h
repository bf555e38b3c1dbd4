// SPDX-License-Identifier: Apache-2.0
// The engine on the data's own meshes, and contacts as their truth lists them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/collider.h"
#include "tests/support/real_scene.h"

namespace warmfront::testing {

std::shared_ptr<const Scene> scene_of(const RealMesh& mesh);

Collider real_collider(const std::shared_ptr<const Scene>& scene, const std::vector<float>& positions,
                       const ColliderOptions& options, int threads);

/// A contact, for any order of vertices in its file.
using RealContact = std::array<std::uint32_t, 5>;
RealContact real_contact(bool edge_edge, std::array<std::uint32_t, 4> v);

}  // namespace warmfront::testing
