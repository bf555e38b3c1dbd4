// SPDX-License-Identifier: Apache-2.0
// The engine on the data's own meshes: see real_collider.h.
#include "tests/support/real_collider.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace warmfront::testing {

std::shared_ptr<const Scene> scene_of(const RealMesh& mesh) {
  SceneDescription description;
  description.vertex_count = static_cast<std::uint32_t>(mesh.positions.size() / 3);
  description.faces = mesh.faces;
  return std::make_shared<const Scene>(std::move(Scene::create(std::move(description))).value());
}

Collider real_collider(const std::shared_ptr<const Scene>& scene, const std::vector<float>& positions,
                       const ColliderOptions& options, int threads) {
  auto made =
      Collider::create(scene, std::span<const float>(positions), options, std::make_shared<Workers>(threads));
  EXPECT_TRUE(made.ok());
  return std::move(made).value();
}

RealContact real_contact(bool edge_edge, std::array<std::uint32_t, 4> v) {
  if (edge_edge) {
    if (v[1] < v[0]) std::swap(v[0], v[1]);
    if (v[3] < v[2]) std::swap(v[2], v[3]);
    if (std::tie(v[2], v[3]) < std::tie(v[0], v[1])) {
      std::swap(v[0], v[2]);
      std::swap(v[1], v[3]);
    }
  } else {
    std::sort(v.begin() + 1, v.end());
  }
  return {edge_edge ? 1U : 0U, v[0], v[1], v[2], v[3]};
}

}  // namespace warmfront::testing
