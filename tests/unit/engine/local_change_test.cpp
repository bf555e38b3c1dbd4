// SPDX-License-Identifier: Apache-2.0
// Local changes of a body's elements: what is reused of the old body equals what would be rebuilt, and
// blocks keep what is left of them.
#include "engine/scene/local_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>

#include "engine/bvh/kept_order.h"
#include "engine/bvh/topology.h"
#include "engine/collider.h"
#include "engine/scene/adjacency.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using testing::Faces;
using testing::grid;
using Edges = std::vector<std::array<std::int32_t, 2>>;

constexpr int kSide = 20;
constexpr std::uint32_t kVertices =
    (kSide + 1) * (kSide + 1) + 3;  // the last three are of edges, or isolated

std::vector<double> sheet() {
  std::vector<double> positions;
  for (std::uint32_t v = 0; v < kVertices; ++v)
    positions.insert(positions.end(), {1.0 * (v / (kSide + 1)), 1.0 * (v % (kSide + 1)), 0.0});
  return positions;
}
Scene scene_of(Faces faces, Edges edges) {
  SceneDescription description{kVertices, std::move(faces), {{"", 0, kVertices}}};
  description.edges = std::move(edges);
  return Scene::create(std::move(description)).value();
}

// A few faces near each other deleted, turned over, or put in; perhaps an edge added or removed.
void change_locally(Faces& faces, Edges& edges, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return random() % n; };
  const std::size_t at = below(faces.size() - 8);
  for (std::size_t i = 1 + below(4); i > 0; --i) {
    const std::size_t f = at + below(6);
    switch (below(4)) {
      case 0:
        faces.erase(faces.begin() + static_cast<std::ptrdiff_t>(f));
        break;
      case 1:
        std::swap(faces[f][0], faces[f][1]);
        break;
      case 2:
        faces.insert(faces.begin() + static_cast<std::ptrdiff_t>(f), faces[at]);
        break;
      default:
        faces.push_back({faces[f][0], faces[at][1], faces[f][2]});
        break;
    }
  }
  if (below(3) == 0) edges.push_back({faces[at][0], static_cast<std::int32_t>(kVertices - 1 - below(3))});
  if (below(4) == 0 && !edges.empty()) edges.erase(edges.begin());
}

struct Body {
  Body(const Faces& faces, const Edges& edges)
      : given(scene_of(faces, edges)), motion(at), topology(given, motion, 64, false) {
    topology.need_adjacent(PartId{0});
  }
  const PartTopology& part() const { return topology.parts[0]; }

  std::vector<double> at = sheet();
  Scene given;
  Motion motion;
  Topology topology;
};

TEST(LocalChange, WhatIsReusedEqualsWhatWouldBeRebuilt) {
  std::mt19937 random(7);
  int kept_hierarchies = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Faces faces = grid(kSide);
    Edges edges{{3, static_cast<std::int32_t>(kVertices) - 3}};
    const Body before(faces, edges);
    change_locally(faces, edges, random);
    const Scene alone = scene_of(faces, edges);
    const MeshRange range = before.part().range();
    const auto given_vertices = before.topology.numbering.given_vertices();
    std::optional<LocalChange> change =
        find_local_change(before.topology.scene, before.topology.numbering, range, alone, given_vertices, {});
    ASSERT_TRUE(change.has_value());
    const std::optional<KeptOrder> kept =
        keep_order({before.part().shape, before.part().order, before.part().shared}, before.topology.scene,
                   range, alone, given_vertices, *change, {});
    if (!kept) continue;
    ++kept_hierarchies;
    // Each primitive once, none of the blocks empty or too full.
    std::set<Primitive> all(kept->order.begin(), kept->order.end());
    ASSERT_EQ(all.size(), kept->order.size());
    ASSERT_EQ(all.size(), alone.element_count() + alone.isolated_vertices().size());
    ASSERT_EQ(kept->shape.leaf_count(), before.part().shape.leaf_count());
    for (BlockId b{0}; b < kept->shape.end_block(); ++b) {
      EXPECT_GE(kept->shape.size_of_block(b), 1u);
      EXPECT_LE(kept->shape.size_of_block(b), 8u);
    }
    EXPECT_LT(std::ranges::count(kept->changed, 1), 20);

    Renumbering numbering({given_vertices.begin(), given_vertices.end()});
    numbering.extend(alone, kept->order);
    Scene scene;
    numbering.extend(alone, scene);
    change->renumber(numbering, {});
    const Orphans followed = enumerate_orphans(scene, before.part().orphans, range, *change, {});
    const Orphans anew = enumerate_orphans(scene);
    EXPECT_EQ(followed.vertex_face, anew.vertex_face);
    EXPECT_EQ(followed.edge_edge, anew.edge_edge);
    std::vector<Primitive> order = kept->order;
    for (Primitive& p : order) p = numbering.apply(p);
    EXPECT_EQ(*shared_vertices(scene, kept->shape, order, *before.part().shared, kept->changed, {}),
              *shared_vertices(scene, kept->shape, order));
    std::vector<std::uint8_t> at(change->near.size());
    std::ranges::transform(change->near, at.begin(),
                           [](auto near) { return near == LocalChange::Near::kAt; });
    EXPECT_EQ(before.topology.adjacent_pairs + count_adjacent_pairs_at(scene, whole(scene), at) -
                  count_adjacent_pairs_at(before.topology.scene, range.features, at),
              count_adjacent_pairs(scene));
    const Ownership owners(scene, before.topology.ownership, range, *change, {}), owners_anew(scene);
    for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
      for (std::uint32_t g = f + 1; g < scene.face_count(); ++g) {
        if (adjacent(scene.faces()[f], scene.faces()[g])) continue;
        const auto one = owners.candidates(f, g), other = owners_anew.candidates(f, g);
        ASSERT_EQ(one.owned, other.owned);
        ASSERT_EQ(one.perhaps, other.perhaps);
      }
    }
  }
  EXPECT_GT(kept_hierarchies, 30);
}

TEST(LocalChange, ManyChangedFacesAreNoLocalChange) {
  const Body before(grid(kSide), {});
  Faces faces = grid(kSide);
  for (std::size_t f = 0; f < faces.size(); f += 4) std::swap(faces[f][0], faces[f][1]);
  EXPECT_FALSE(find_local_change(before.topology.scene, before.topology.numbering, before.part().range(),
                                 scene_of(faces, {}), before.topology.numbering.given_vertices(), {}));
}

TEST(LocalChange, FacesThatChangedPlacesKeepTheOrderOfMost) {
  const Body before(grid(kSide), {});
  Faces faces = grid(kSide);
  std::swap(faces[10], faces[700]);
  const auto change =
      find_local_change(before.topology.scene, before.topology.numbering, before.part().range(),
                        scene_of(faces, {}), before.topology.numbering.given_vertices(), {});
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(std::ranges::count(change->face_before, LocalChange::kNone), 2);
}

// A cloth of which some faces are others before each step, beside one created from scratch.
TEST(LocalChange, ContactsAreThoseOfANewCollider) {
  std::mt19937 random(11);
  const auto workers = std::make_shared<Workers>(1);
  Faces faces = grid(kSide);
  Edges edges;
  const auto folded = [](double phase) {
    std::vector<double> positions = sheet();
    for (std::size_t v = 0; v < kVertices; ++v) {
      positions[3 * v + 2] = std::sin(positions[3 * v] * 1.7 + phase) * 2;
      positions[3 * v] *= 0.1;
    }
    return positions;
  };
  const auto make = [&](const std::vector<double>& at) {
    return Collider::create(std::make_shared<const Scene>(scene_of(faces, edges)),
                            std::span<const double>(at), {}, workers)
        .value();
  };
  std::vector<double> at = folded(0);
  Collider warm = make(at);
  std::size_t contacts = 0, after_ten = 0;
  for (int step = 1; step <= 60; ++step) {
    change_locally(faces, edges, random);
    ASSERT_TRUE(warm.replace_elements(0, faces, edges).ok());
    if (step % 3 == 0) {
      change_locally(faces, edges, random);
      ASSERT_TRUE(warm.replace_elements(0, faces, edges).ok());
    }
    Collider fresh = make(at);
    at = folded(0.3 * step);
    const StepResult one = warm.step(std::span<const double>(at)).value();
    const StepResult other = fresh.step(std::span<const double>(at)).value();
    ASSERT_TRUE(std::ranges::equal(one.contacts, other.contacts)) << step;
    ASSERT_TRUE(warm.self_check().ok()) << step;
    contacts += one.contacts.size();
    if (step == 10) after_ten = warm.memory_bytes();
  }
  EXPECT_GT(contacts, 1000u);
  EXPECT_LT(warm.memory_bytes(), after_ten + after_ten / 3);
}

TEST(LocalChange, TenThousandChangesLeaveASceneAsLargeAsTen) {
  const auto workers = std::make_shared<Workers>(1);
  Faces faces = grid(8);
  SceneDescription description{81, faces, {{"", 0, 81}}};
  std::vector<double> at;
  for (int v = 0; v < 81; ++v) at.insert(at.end(), {1.0 * (v / 9), 1.0 * (v % 9), 0.0});
  Collider collider = Collider::create(std::make_shared<const Scene>(Scene::create(description).value()),
                                       std::span<const double>(at), {}, workers)
                          .value();
  std::size_t after_some = 0;
  for (int i = 1; i <= 10'000; ++i) {
    Faces other = faces;
    const auto f = static_cast<std::size_t>(i) % 120;
    if (i % 3 == 0) other.erase(other.begin() + static_cast<std::ptrdiff_t>(f));
    std::swap(other[f][0], other[f][1]);
    if (i % 2 == 0) other.push_back({other[f][0], other[f][1], 40});
    ASSERT_TRUE(collider.replace_elements(0, other, {}).ok());
    if (i % 4 == 0) {
      for (std::size_t z = 2; z < at.size(); z += 3) at[z] += i % 8 == 0 ? 0.01 : -0.01;
      ASSERT_TRUE(collider.step(std::span<const double>(at)).ok());
    }
    if (i == 48) after_some = collider.memory_bytes();
  }
  EXPECT_LT(collider.memory_bytes(), after_some + after_some / 20);
  EXPECT_TRUE(collider.self_check().ok());
}

}  // namespace
}  // namespace warmfront
