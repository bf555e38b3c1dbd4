// SPDX-License-Identifier: Apache-2.0
// A renumbered scene is the same scene.
#include "engine/scene/renumbering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "engine/bvh/bvh.h"
#include "tests/support/hierarchy.h"

namespace warmfront {
namespace {

// Two tetrahedra of which one has a double face and the other a strand of edges, an isolated vertex between them
// and one at the end.
Scene make_scene() {
  SceneDescription description;
  description.vertex_count = 13;
  description.faces = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}, {0, 1, 2},
                       {5, 7, 6}, {5, 6, 8}, {6, 7, 8}, {7, 5, 8}};
  description.edges = {{9, 10}, {11, 9}, {11, 5}};
  return std::move(Scene::create(std::move(description))).value();
}

TEST(RenumberingTest, KeepsEveryFeatureAndList) {
  const Scene given = make_scene();
  std::mt19937 random(3);
  std::vector<Primitive> order = testing::all_primitives(given);
  for (int trial = 0; trial < 50; ++trial) {
    std::shuffle(order.begin(), order.end(), random);
    const Renumbering numbering(given, order);
    Scene scene;
    numbering.extend(given, scene);
    const auto old_vertex = [&](std::uint32_t v) { return number_of(numbering.given(NewVertex{v})); };
    const auto old_face = [&](std::uint32_t f) { return number_of(numbering.given(NewFace{f})); };

    for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
      ASSERT_EQ(numbering.renumbered(GivenFace{old_face(f)}), NewFace{f});
      const Contact contact{ContactKind::kVertexFace, ContactStatus::kHit, scene.faces()[f][0], f, 0};
      ASSERT_EQ(numbering.given(contact).a, old_vertex(contact.a));
      ASSERT_EQ(numbering.given(contact).b, old_face(f));
    }
    for (std::uint32_t v = 0; v < scene.vertex_count(); ++v)
      ASSERT_EQ(numbering.renumbered(GivenVertex{old_vertex(v)}), NewVertex{v});
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Face before = primitive_vertices(given, order[i]);
      const Face after = primitive_vertices(scene, numbering.apply(order[i]));
      for (int k = 0; k < 3; ++k) ASSERT_EQ(old_vertex(after[k]), before[k]);
    }
    for (std::uint32_t f = 0; f < scene.face_count(); ++f)
      ASSERT_EQ(scene.face_edges()[f], given.face_edges()[old_face(f)]);
    ASSERT_TRUE(std::ranges::equal(scene.lone_edges(), given.lone_edges()));
    for (std::uint32_t e = 0; e < scene.edge_count(); ++e) {
      for (int k = 0; k < 2; ++k) ASSERT_EQ(old_vertex(scene.edges()[e][k]), given.edges()[e][k]);
      ASSERT_EQ(scene.edge_faces()[e].size(), given.edge_faces()[e].size());
      for (std::size_t k = 0; k < scene.edge_faces()[e].size(); ++k)
        ASSERT_EQ(old_face(scene.edge_faces()[e][k]), given.edge_faces()[e][k]);
    }
    for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
      const auto before = given.vertex_faces()[old_vertex(v)];
      ASSERT_EQ(scene.vertex_faces()[v].size(), before.size());
      for (std::size_t k = 0; k < before.size(); ++k)
        ASSERT_EQ(old_face(scene.vertex_faces()[v][k]), before[k]);
      ASSERT_TRUE(std::ranges::equal(scene.lone_edges_of(v), given.lone_edges_of(old_vertex(v))));
      ASSERT_EQ(scene.is_isolated(v), given.is_isolated(old_vertex(v)));
      ASSERT_EQ(scene.body_of_vertex()[v], given.body_of_vertex()[old_vertex(v)]);
    }
  }
}

TEST(RenumberingTest, LeavesEdgesOfAContactAlone) {
  const Scene given = make_scene();
  std::vector<Primitive> order = testing::all_primitives(given);
  std::ranges::reverse(order);
  const Renumbering numbering(given, order);
  const Contact contact{ContactKind::kEdgeEdge, ContactStatus::kHit, 3, 4, 0.5};
  EXPECT_EQ(numbering.given(contact), contact);
}

}  // namespace
}  // namespace warmfront
