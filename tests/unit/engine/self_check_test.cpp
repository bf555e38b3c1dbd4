// SPDX-License-Identifier: Apache-2.0
// Each kind of damage, made on purpose: the self-check finds and names it.
#include "engine/check/self_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "engine/broad_phase/near_parts.h"
#include "engine/check/check_neighbours.h"
#include "engine/collider.h"
#include "tests/support/hierarchy.h"
#include "tests/support/scenes.h"
#include "tests/unit/engine/kept_pipeline.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using testing::two_grids;
using testing::wavy_grids;
template <class Bounds>
using Kept = testing::KeptPipeline<Bounds>;

template <class Bounds>
class SelfCheckOf : public ::testing::Test {
 protected:
  void expect_found(const std::function<void(Kept<Bounds>&)>& corrupt, ErrorCode code, const char* words,
                    std::uint32_t leaf_size = 8) {
    Kept<Bounds> kept(leaf_size);
    ASSERT_TRUE(kept.check().ok()) << kept.check().error().message;
    corrupt(kept);
    const Status status = kept.check();
    ASSERT_FALSE(status.ok()) << words;
    EXPECT_EQ(status.error().code, code);
    EXPECT_THAT(status.error().message, HasSubstr(words));
  }
};
using BothBounds = ::testing::Types<Aabb, KDop18>;
TYPED_TEST_SUITE(SelfCheckOf, BothBounds);

TYPED_TEST(SelfCheckOf, WhatCannotBeMadeAnewIsDataLoss) {
  using K = Kept<TypeParam>;
  const auto loss = ErrorCode::kDataLoss;
  this->expect_found([](K& k) { const_cast<Face&>(k.core.topology->scene.faces()[5])[1] ^= 1; }, loss,
                     "topology has changed");
  this->expect_found([](K& k) { const_cast<Face&>(k.core.scene->faces()[7])[2] ^= 1U << 20; }, loss,
                     "topology has changed");
  this->expect_found(
      [](K& k) {
        EdgeId& edge = k.core.topology->parts[1].orphans.edge_edge[3].b;
        edge = EdgeId{number_of(edge) ^ 4};
      },
      loss, "topology has changed");
  this->expect_found([](K& k) { const_cast<std::uint32_t&>(k.core.filter.patches()[3]) ^= 8; }, loss,
                     "filters leave out has changed");
  this->expect_found(
      [](K& k) { const_cast<std::uint32_t&>(k.core.filter.excluded_vertices().items()[1]) ^= 1; }, loss,
      "filters leave out has changed");
  this->expect_found([](K& k) { const_cast<double&>(k.core.filter.rest_shape()[2][1]) += 1e-9; }, loss,
                     "filters leave out has changed");
  this->expect_found(
      [](K& k) {
        const std::uint32_t v = number_of(k.core.topology->numbering.renumbered(GivenVertex{17}));
        const_cast<VertexMotion&>(k.core.motion.vertices().vertices()[v]).t1[0] += 1e-3;
      },
      loss, "vertex 17 is outside its bounds");
}

TYPED_TEST(SelfCheckOf, AHierarchyThatIsBrokenIsNamed) {
  using K = Kept<TypeParam>;
  const auto broken = ErrorCode::kInternal;
  this->expect_found([](K& k) { k.trees[0].order[3] = k.trees[0].order[4]; }, broken,
                     "of part 0 does not contain each primitive exactly once");
  this->expect_found([](K& k) { std::swap(k.trees[1].order[0], k.trees[1].order[200]); }, broken,
                     "leaves of part 1");
  this->expect_found([](K& k) { k.trees[1].patches.assign(k.trees[1].shape.node_count(), 3); }, broken,
                     "patches of nodes of part 1");
  this->expect_found([](K& k) { ++k.trees[1].face_leaves.leaf[9]; }, broken, "leaves of part 1");
  this->expect_found([](K& k) { k.trees[0].leaves.corners[2].vertex[1][0] ^= 1; }, broken,
                     "leaves of part 0");
  this->expect_found([](K& k) { k.trees[0].leaves.shared = k.trees[1].leaves.shared; }, broken,
                     "leaves of part 0");
  this->expect_found([](K& k) { k.trees[0].leaves.blocks[2].row[0][0] += 50; }, broken,
                     "of part 0 does not contain its children");
  this->expect_found([](K& k) { k.trees[0].leaves.grids[1].begin_at_1 += 1; }, broken, "leaves of part 0");
  this->expect_found([](K& k) { k.trees[0].leaves.grids[1].end[1].exponent += 1; }, broken,
                     "of part 0 does not contain its children");
  this->expect_found([](K& k) { k.trees[0].leaves.grids[0].end[0].origin[2] += 0.125F; }, broken,
                     "of part 0 does not contain its children");
  this->expect_found([](K& k) { k.trees[1].nodes[6].lane[2] += 0.125F; }, broken,
                     "of part 1 does not contain its children");
  this->expect_found([](K& k) { k.trees[1].nodes[0].lane[5] = std::numeric_limits<float>::quiet_NaN(); },
                     broken, "node 0 of part 1 does not contain its children");
}

TYPED_TEST(SelfCheckOf, AWideLeafThatIsBrokenIsNamed) {
  using K = Kept<TypeParam>;
  const auto broken = ErrorCode::kInternal;
  const auto expect = [&](const std::function<void(K&)>& corrupt, const char* words) {
    this->expect_found(corrupt, broken, words, 64);
  };
  expect([](K& k) { k.trees[0].leaves.blocks_of[1].end = k.trees[0].leaves.blocks_of[1].begin; },
         "leaves of part 0");
  expect([](K& k) { ++k.trees[1].leaves.blocks_of[0].begin; }, "leaves of part 1");
  expect([](K& k) { k.trees[1].leaves.grids[0].begin_at_1 ^= 2; }, "leaves of part 1");
  expect([](K& k) { k.trees[1].leaves.blocks_of.pop_back(); }, "leaves of part 1");
  expect([](K& k) { k.trees[0].leaves.corners[9].vertex[2][3] ^= 1; }, "leaves of part 0");
  expect([](K& k) { k.trees[0].leaves.corners.pop_back(); }, "leaves of part 0");
  expect([](K& k) { k.trees[0].leaves.blocks[9].row[1][6] += 50; },
         "of part 0 does not contain its children");
  expect([](K& k) { k.trees[1].leaves.wide[1].row[4][4] += 50; }, "of part 1 does not contain its children");
}

TYPED_TEST(SelfCheckOf, AFrontThatIsNoCutIsNamed) {
  using K = Kept<TypeParam>;
  const auto broken = ErrorCode::kInternal;
  this->expect_found([](K& k) { k.near.erase(k.near.begin() + 1); }, broken,
                     "parts 0 and 1 are near but have no front");
  this->expect_found([](K& k) { k.front.forget(PartId{0}); }, broken, "has no pairs below (0, 0)");
  this->expect_found(
      [](K& k) {
        NodeId& node = k.segment(0).chunks[0].pairs[20].nodes.a;
        node = NodeId{number_of(node) ^ 2};
      },
      broken, "lacks pair");
  this->expect_found(
      [](K& k) { k.segment(0).chunks[0].pairs.erase(k.segment(0).chunks[0].pairs.begin() + 30); }, broken,
      "of parts 0 and 0 lacks pair");
  this->expect_found([](K& k) { k.segment(0).chunks.pop_back(); }, broken, "has no pairs below");
  this->expect_found(
      [](K& k) {
        auto& pairs = k.segment(0).chunks.back().pairs;
        pairs.push_back(pairs.back());
      },
      broken, "out of place");
  this->expect_found([](K& k) { k.segment(1).size += 1; }, broken, "has a wrong pair count");
  this->expect_found(
      [](K& k) {
        // Two nodes held apart that are not: one of them grows over everything.
        const FrontPair pair = k.first_disjoint();
        const FrontSegment& segment = k.segment(0);
        for (NodeId node = pair.nodes.a;; node = TreeShape::parent(node)) {
          for (float& lane : k.trees[number_of(segment.parts.a)].nodes[number_of(node)].lane) lane = -1e30F;
          if (node == kRoot) break;
        }
      },
      broken, "as disjoint");
  this->expect_found(
      [](K& k) {
        const auto far = [&](const FrontPair& pair) {
          return separation(k.trees[0].nodes[number_of(pair.nodes.a)],
                            k.trees[0].nodes[number_of(pair.nodes.b)]) > 0;
        };
        for (FrontChunk& chunk : k.segment(0).chunks) {
          const auto pair = std::ranges::find_if(chunk.pairs, far);
          if (pair == chunk.pairs.end()) continue;
          pair->adjacent = true;
          return;
        }
      },
      broken, "as adjacent");
  this->expect_found(
      [](K& k) {
        k.segment(2).chunks[0].kept.pairs.push_back({1U << 30, 1, 0});
      },
      broken, "caches answers of pairs that it does not contain");
  this->expect_found([](K& k) { k.segment(2).chunks[0].kept.contacts.push_back({}); }, broken,
                     "has a wrong count of cached contacts");
}

TYPED_TEST(SelfCheckOf, NeighboursThatAreLeftOutOrTakenForApartAreNamed) {
  using K = Kept<TypeParam>;
  constexpr std::uint32_t kWide = 32;
  const auto pairs = [](K& k) -> std::vector<NeighbourPair>& { return k.neighbours(0).pairs; };
  const auto broken = ErrorCode::kInternal;
  this->expect_found([&](K& k) { pairs(k).pop_back(); }, broken, "does not list the neighbouring blocks",
                     kWide);
  this->expect_found([&](K& k) { pairs(k)[3].excluded ^= 1; }, broken,
                     "does not list the neighbouring blocks", kWide);
  this->expect_found([](K& k) { --k.neighbours(0).leaves[1].end; }, broken,
                     "does not list the neighbouring blocks", kWide);
  this->expect_found(
      [&](K& k) {
        // All of it comes together in one place.
        for (PointBounds& bounds : k.core.vertex_bounds) bounds = k.core.vertex_bounds[0];
        for (NeighbourPair& pair : pairs(k)) {
          const auto& travel = k.trees[0].travel.blocks;
          pair.budget = TravelBudget::grant(travel[number_of(pair.a)], travel[number_of(pair.b)], 1);
        }
        const std::string wrong =
            broken_neighbours<TypeParam>(k.front.neighbours().of(PartId{0}), k.trees[0],
                                         k.core.topology->scene, k.core.vertex_bounds, Width(), kBudgetTurns);
        EXPECT_THAT(wrong, HasSubstr("and a neighbour as apart"));
        pairs(k).clear();
      },
      ErrorCode::kDataLoss, "is outside its bounds", kWide);
}

TYPED_TEST(SelfCheckOf, PartsWronglyKeptAsSeparatedAreNamed) {
  using K = Kept<TypeParam>;
  // The grids lie across each other: along no direction is one beyond the other.
  for (const std::array<double, 3>& direction :
       {std::array{0.0, 0.0, 1.0}, std::array{0.0, 0.0, -1.0}, std::array{0.0, 0.0, 0.0}}) {
    this->expect_found(
        [&](K& k) {
          k.near.erase(k.near.begin() + 1);
          k.apart.push_back({{PartId{0}, PartId{1}}, direction});
        },
        ErrorCode::kInternal, "parts 0 and 1 are not apart along the direction");
  }
}

// The earliest contact is searched again when nothing moves, and pairs opened by a motion are then folded.
TEST(SelfCheck, CountsAFrontThatFoldsAtRest) {
  ColliderOptions options;
  options.report = Report::kEarliest;
  options.leaf_size = 1;
  const std::vector<double> start = wavy_grids(0.3);
  for (const bool lazy : {false, true}) {
    options.lazy_front = lazy;
    Collider collider =
        Collider::create(std::make_shared<const Scene>(Scene::create(two_grids()).value()),
                         std::span<const double>(start), options, std::make_shared<Workers>(2))
            .value();
    for (int step = 0; step < 30; ++step) {
      const std::vector<double> positions = wavy_grids(step == 3 ? 1.5 : 0.3);
      ASSERT_TRUE(collider.step(std::span<const double>(positions)).ok());
      const Status sound = collider.self_check();
      EXPECT_TRUE(sound.ok()) << sound.error().message << ", step " << step << (lazy ? ", lazy" : "");
    }
  }
}

// Of two rigid sheets in one place and one a little above them, only these two are near: their hierarchies'
// roots, which are made after that was found, may be looser, and reach the third.
TEST(SelfCheck, JudgesNearnessByTheBoundsThatWereLookedAt) {
  constexpr int kCells = 4;
  SceneDescription description;
  std::vector<double> positions;
  for (std::int32_t b = 0; b < 3; ++b) {
    const auto first = static_cast<std::int32_t>(positions.size() / 3);
    for (auto face : testing::grid(kCells)) {
      for (auto& v : face) v += first;
      description.faces.push_back(face);
    }
    const double off = (b == 0 ? 376 : 378) / 4096.0;
    for (int i = 0; i <= kCells; ++i) {
      for (int j = 0; j <= kCells; ++j)
        positions.insert(positions.end(), {off + 1.0 * i / kCells, off - 1.0 * i / kCells, 1.0 * j / kCells});
    }
    description.vertex_count = static_cast<std::uint32_t>(positions.size() / 3);
    const auto begin = static_cast<std::uint32_t>(first);
    description.bodies.push_back({"", begin, description.vertex_count - begin, BodyKind::kRigid});
  }
  std::vector<double> moved = positions;
  for (std::size_t x = 2; x < moved.size(); x += 3) moved[x] += 4;
  const auto scene = std::make_shared<const Scene>(Scene::create(description).value());
  for (const BoundsKind bounds : {BoundsKind::kAabb, BoundsKind::kKDop18}) {
    Collider collider = Collider::create(scene, std::span<const double>(positions), {.bounds = bounds},
                                         std::make_shared<Workers>(1))
                            .value();
    for (const auto* frame : {&positions, &moved, &positions}) {
      ASSERT_TRUE(collider.step(std::span<const double>(*frame)).ok());
      const Status sound = collider.self_check();
      EXPECT_TRUE(sound.ok()) << sound.error().message;
    }
  }
}

TEST(SelfCheck, IsPassedByAColliderThatHasNothingToShow) {
  const std::vector<double> start = wavy_grids(0.5), next = wavy_grids(0.3);
  Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(two_grids()).value()),
                                       std::span<const double>(start), {}, std::make_shared<Workers>(1))
                          .value();
  EXPECT_TRUE(collider.self_check().ok()) << "before its first step";
  collider.forget_warmth();
  const auto first = collider.step(std::span<const double>(next));
  ASSERT_TRUE(first.ok());
  EXPECT_GT(first.value().contacts.size(), 50U);
  EXPECT_EQ(first.value().statistics.front_state, FrontState::kBuilt);
  EXPECT_TRUE(collider.self_check().ok());
  collider.forget_warmth();
  EXPECT_TRUE(collider.self_check().ok()) << "all is made anew in the next step";
  const auto second = collider.step(std::span<const double>(start));
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second.value().statistics.front_state, FrontState::kRebuilt);
}

}  // namespace
}  // namespace warmfront
