// SPDX-License-Identifier: Apache-2.0
#include "engine/eigen.h"

#include <gtest/gtest.h>

namespace warmfront {
namespace {

TEST(Eigen, MatricesStepThroughTheCollider) {
  VertexMatrix<double> v0(4, 3);
  v0 << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1;
  VertexMatrix<double> v1 = v0;
  v1(3, 2) = -1;
  FaceMatrix faces(1, 3);
  faces << 0, 1, 2;
  auto scene = Scene::create(describe(v0, faces));
  ASSERT_TRUE(scene.ok());
  auto collider = Collider::create(std::make_shared<const Scene>(std::move(scene).value()), positions_of(v0),
                                   {}, std::make_shared<Workers>(1));
  ASSERT_TRUE(collider.ok());
  const auto result = collider.value().step(positions_of(v1));
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.value().vf, 1U);
  EXPECT_NEAR(*result.value().earliest_toi, 0.5, 1e-6);
}

}  // namespace
}  // namespace warmfront
