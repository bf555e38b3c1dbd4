// SPDX-License-Identifier: Apache-2.0
// A hierarchy refit from step to step against the same one whose bounds are made anew.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

template <class Bounds>
class RefitTest : public ::testing::Test {};
using Kinds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(RefitTest, Kinds);

template <class Eight, class Eights>
void expect_same_eights(const Eights& refit, const Eights& anew, const char* what) {
  ASSERT_EQ(refit.size(), anew.size());
  for (std::size_t i = 0; i < anew.size(); ++i) {
    const Eight& a = refit[i];
    const Eight& b = anew[i];
    ASSERT_EQ(a.count, b.count);
    for (std::size_t lane = 0; lane < b.lane.size(); ++lane) {
      for (std::uint32_t slot = 0; slot < b.count; ++slot)
        ASSERT_EQ(a.lane[lane][slot], b.lane[lane][slot])
            << what << " " << i << ", lane " << lane << ", slot " << slot;
    }
  }
}

template <class Bounds>
void expect_same_bounds(const Bvh<Bounds>& refit, const Bvh<Bounds>& anew) {
  ASSERT_EQ(refit.nodes.size(), anew.nodes.size());
  for (std::size_t n = 0; n < anew.nodes.size(); ++n) ASSERT_EQ(refit.nodes[n].lane, anew.nodes[n].lane) << n;
  expect_same_eights<EightBounds<Bounds>>(refit.blocks, anew.blocks, "block");
  expect_same_eights<EightBounds<Bounds>>(refit.wide, anew.wide, "wide leaf");
}

TYPED_TEST(RefitTest, FromStepToStepIsAnewBitForBit) {
  std::mt19937_64 random(7);
  for (int world = 0; world < 40; ++world) {
    RandomScene scene = random_scene(random);
    const std::uint32_t leaf_size = 1U << (random() % 7);
    Hierarchy<TypeParam> hierarchy(scene.scene, scene.positions, leaf_size);
    for (int step = 0; step < 12; ++step) {
      // Some steps rest as a whole: then what moved before comes to rest.
      if (random() % 4 != 0) scene.positions = random_motion(random, *scene.scene, scene.positions);
      hierarchy.step(scene.positions);
      expect_same_bounds(hierarchy.bvh, hierarchy.anew());
      ASSERT_FALSE(this->HasFatalFailure()) << "world " << world << ", step " << step;
    }
  }
}

}  // namespace
}  // namespace warmfront::testing
