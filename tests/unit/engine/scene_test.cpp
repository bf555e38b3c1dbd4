// SPDX-License-Identifier: Apache-2.0
#include "engine/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "engine/scene/adjacency.h"
#include "engine/scene/orphans.h"
#include "engine/scene/ownership.h"
#include "tests/support/brute_force.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string error_of(SceneDescription description) {
  const auto scene = Scene::create(std::move(description));
  return scene.ok() ? "" : scene.error().message;
}

TEST(Scene, NamesTheFirstBadIndex) {
  EXPECT_THAT(error_of({.vertex_count = 3, .faces = {{0, 1, 2}, {0, 1, 3}}, .bodies = {}}),
              HasSubstr("faces[1][2]: vertex index 3 is not in [0, 3)"));
  EXPECT_THAT(error_of({.vertex_count = 3, .faces = {{0, -1, 2}}, .bodies = {}}),
              HasSubstr("faces[0][1]: vertex index -1"));
}

TEST(Scene, HasTheEdgesOfFacesAndThoseGivenBesides) {
  // A face, an edge from it, one that is a side of it, one twice, and a strand.
  const auto scene = testing::make_scene(8, {{0, 1, 2}}, {{3, 1}, {2, 1}, {1, 3}, {5, 4}, {5, 6}});
  EXPECT_THAT(scene->edges(),
              ElementsAre(Edge{0, 1}, Edge{0, 2}, Edge{1, 2}, Edge{1, 3}, Edge{4, 5}, Edge{5, 6}));
  EXPECT_THAT(scene->lone_edges(), ElementsAre(3, 4, 5));
  EXPECT_THAT(scene->lone_edges_of(1), ElementsAre(3));
  EXPECT_THAT(scene->lone_edges_of(5), ElementsAre(4, 5));
  EXPECT_THAT(scene->isolated_vertices(), ElementsAre(7));
  EXPECT_EQ(scene->body_count(), 3U) << "the face with its edge, the strand, and a point";
  EXPECT_THAT(testing::make_scene(4, {}, {{0, 1}, {2, 3}})->lone_edges(), ElementsAre(0, 1)) << "edges alone";
}

TEST(Scene, RefusesEdgesThatAreNone) {
  const auto with = [](std::vector<std::array<std::int32_t, 2>> edges) {
    return SceneDescription{
        .vertex_count = 4, .faces = {}, .bodies = {{"a", 0, 2}, {"b", 2, 2}}, .edges = std::move(edges)};
  };
  EXPECT_THAT(error_of(with({{0, 1}, {1, 4}})), HasSubstr("edges[1][1]: vertex index 4 is not in [0, 4)"));
  EXPECT_THAT(error_of(with({{-1, 1}})), HasSubstr("edges[0][0]: vertex index -1"));
  EXPECT_THAT(error_of(with({{2, 2}})), HasSubstr("edges[0]: joins vertex 2 to itself"));
  EXPECT_THAT(error_of(with({{2, 1}})), HasSubstr("edges: (1, 2) joins bodies[0] and bodies[1]"));
}

TEST(Scene, MayHavePointsAlone) {
  EXPECT_THAT(testing::make_scene(4, {})->isolated_vertices(), ElementsAre(0, 1, 2, 3));
  const auto dust = Scene::create({.vertex_count = 4, .faces = {}, .bodies = {{"dust", 0, 4}}});
  ASSERT_TRUE(dust.ok());
  EXPECT_TRUE(dust.value().with_body({{"more", 0, 2}, {}}).ok());
}

// What a client sends is held for it, and counts.
TEST(Scene, NamesCountAsMemory) {
  const auto body = [](std::size_t name_bytes, std::uint32_t first) {
    Body made;
    made.name.assign(name_bytes, 'n');
    made.first_vertex = first;
    made.vertex_count = 3;
    return made;
  };
  const auto scene_of = [&](std::size_t name_bytes) {
    SceneDescription description;
    description.vertex_count = 6;
    description.faces = {{0, 1, 2}, {3, 4, 5}};
    description.bodies.push_back(body(name_bytes, 0));
    description.bodies.push_back(body(0, 3));
    return Scene::create(std::move(description)).value();
  };
  const auto addition = [&](std::size_t name_bytes) {
    BodyAddition added;
    added.body = body(name_bytes, 0);
    added.faces = {{0, 1, 2}};
    return added;
  };
  const Scene scene = scene_of(1000);
  const std::size_t without = scene_of(0).memory_bytes();
  EXPECT_EQ(scene.memory_bytes(), without + 1000);
  EXPECT_EQ(scene.with_body_changed(0, body(10, 0)).value().memory_bytes(), without + 10);
  EXPECT_EQ(scene.with_bodies({body(20, 0), body(0, 3)}).value().memory_bytes(), without + 20);
  EXPECT_EQ(scene.with_body(addition(300)).value().memory_bytes(),
            scene.with_body(addition(0)).value().memory_bytes() + 300);
  EXPECT_THAT(scene.with_body(addition(2000)).error().message,
              HasSubstr("bodies[2].name: is 2000 bytes long"));
  EXPECT_THAT(scene.with_body_changed(1, body(2000, 0)).error().message, HasSubstr("bodies[1].name"));
}

// A face that repeats an index is the segment or the point that it names: each of its sides counts once.
TEST(Scene, AFaceMayRepeatAnIndex) {
  const auto scene = testing::make_scene(5, {{0, 0, 1}, {2, 3, 2}, {4, 4, 4}, {1, 2, 3}});
  EXPECT_THAT(scene->edges(), ElementsAre(Edge{0, 0}, Edge{0, 1}, Edge{1, 2}, Edge{1, 3}, Edge{2, 2},
                                          Edge{2, 3}, Edge{4, 4}));
  EXPECT_THAT(scene->vertex_faces()[0], ElementsAre(0));
  EXPECT_THAT(scene->vertex_faces()[2], ElementsAre(1, 3));
  EXPECT_THAT(scene->edge_faces()[5], ElementsAre(1, 3)) << "once each";
  EXPECT_THAT(scene->edge_faces()[6], ElementsAre(2));
  EXPECT_TRUE(scene->isolated_vertices().empty());
  EXPECT_EQ(count_adjacent_pairs(*scene), 2U) << "the triangle with either segment";
}

TEST(Scene, ChecksBodies) {
  const auto with = [](std::vector<Body> bodies) {
    return error_of({.vertex_count = 6, .faces = {{0, 1, 2}, {3, 4, 5}}, .bodies = std::move(bodies)});
  };
  EXPECT_EQ(with({{"a", 0, 3, {}}, {"b", 3, 3, {}}}), "");
  EXPECT_THAT(with({{"a", 0, 3, {}}, {"b", 4, 2, {}}}),
              HasSubstr("bodies[1].first_vertex: is 4 where 3 is expected"));
  EXPECT_THAT(with({{"a", 0, 3, {}}, {"b", 2, 4, {}}}), HasSubstr("overlap"));
  EXPECT_THAT(with({{"a", 0, 3, {}}}), HasSubstr("cover 3 of 6"));
  EXPECT_THAT(with({{"a", 0, 7, {}}}), HasSubstr("ends at vertex 7 of 6"));
  EXPECT_THAT(with({{"a", 0, 0, {}}}), HasSubstr("bodies[0].vertex_count"));
  EXPECT_THAT(with({{"a", 0, 2}, {"b", 2, 4}}), HasSubstr("faces[0]: joins bodies[0] and bodies[1]"));
  EXPECT_THAT(with({{"a", 0, 3, {}, true, 0}, {"b", 3, 3}}), HasSubstr("bodies[0].group: is 0"));
  EXPECT_THAT(with({{"a", 0, 3}, {"b", 3, 3, {}, true, 1, 0}}), HasSubstr("bodies[1].mask: is 0"));
  EXPECT_EQ(with({{std::string(1024, 'a'), 0, 3}, {"b", 3, 3}}), "");
  EXPECT_THAT(with({{"a", 0, 3}, {std::string(1025, 'b'), 3, 3}}),
              HasSubstr("bodies[1].name: is 1025 bytes long, and may be 1024"));
  const auto named = [&](const std::string& name) { return with({{"a", 0, 3}, {name, 3, 3}}); };
  for (const char* text :
       {"", "\x01", "\u007f\u0080", "\u07ff\u0800", "\ud7ff\ue000", "\uffff", "\U00010000\U0010ffff"})
    EXPECT_EQ(named(text), "") << text;
  // A lone continuation, too few of them, longer forms than are needed, surrogates, what is beyond Unicode.
  for (const char* bytes :
       {"\x80", "\xc3", "\xc3(", "\xe2\x82", "\xc0\x80", "\xc1\xbf", "\xe0\x9f\xbf", "\xf0\x8f\xbf\xbf",
        "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff"})
    EXPECT_THAT(named(std::string("\u00fc") + bytes),
                HasSubstr("bodies[1].name: is no UTF-8 from byte 2 on"));
  const auto excluding = [](std::uint32_t a, std::uint32_t b) {
    return error_of({.vertex_count = 6,
                     .faces = {{0, 1, 2}, {3, 4, 5}},
                     .bodies = {{"a", 0, 3}, {"b", 3, 3}},
                     .excluded_pairs = {{a, b}}});
  };
  EXPECT_EQ(excluding(1, 0), "");
  EXPECT_THAT(excluding(0, 2), HasSubstr("excluded_pairs[0]: body 2 is not in [0, 2)"));
  EXPECT_THAT(excluding(1, 1), HasSubstr("switch its self_collision off"));
}

TEST(Scene, FindsEdgesAndIncidence) {
  // Two triangles on edge (1, 2), a third on it too (non-manifold), and an isolated vertex.
  const auto scene = testing::make_scene(6, {{0, 1, 2}, {2, 1, 3}, {1, 2, 4}});
  EXPECT_THAT(scene->edges(), ElementsAre(Edge{0, 1}, Edge{0, 2}, Edge{1, 2}, Edge{1, 3}, Edge{1, 4},
                                          Edge{2, 3}, Edge{2, 4}));
  EXPECT_THAT(scene->edge_faces()[2], ElementsAre(0, 1, 2));
  EXPECT_THAT(scene->vertex_faces()[3], ElementsAre(1));
  EXPECT_THAT(scene->isolated_vertices(), ElementsAre(5));
  EXPECT_EQ(scene->body_count(), 2U);
  EXPECT_THAT(scene->body_of_vertex(), ElementsAre(0, 0, 0, 0, 0, 1));
  EXPECT_EQ(scene->vertices_of({ContactKind::kVertexFace, ContactStatus::kHit, 3, 0, 0}),
            (std::array<std::uint32_t, 4>{3, 0, 1, 2}));
  EXPECT_EQ(scene->vertices_of({ContactKind::kEdgeEdge, ContactStatus::kHit, 0, 5, 0}),
            (std::array<std::uint32_t, 4>{0, 1, 2, 3}));
}

TEST(Scene, AnEmptySceneIsLegal) {
  const auto scene = testing::make_scene(0, {});
  EXPECT_EQ(scene->body_count(), 0U);
}

std::size_t valid_pairs(const Scene& scene) {
  std::size_t count = 0;
  testing::for_all_feature_pairs(scene, [&](auto, auto, auto) { ++count; });
  return count;
}

// The counts that reference/algorithms 2.3 gives.
TEST(Orphans, KnownCounts) {
  const auto count = [](std::uint32_t vertices, const testing::Faces& faces) {
    const auto scene = testing::make_scene(vertices, faces);
    const Orphans orphans = enumerate_orphans(*scene);
    return std::pair(orphans.vertex_face.size() + orphans.edge_edge.size(), valid_pairs(*scene));
  };
  EXPECT_EQ(count(4, testing::tetrahedron()), std::pair(std::size_t{7}, std::size_t{7}));
  EXPECT_EQ(count(6, testing::octahedron()), std::pair(std::size_t{0}, std::size_t{54}));
  EXPECT_EQ(count(16, testing::grid(3)), std::pair(std::size_t{64}, std::size_t{646}));
  EXPECT_EQ(count(49, testing::grid(6)), std::pair(std::size_t{124}, std::size_t{9949}));
}

// Counted by looking at all pairs: fins, bow-ties and duplicate faces included.
TEST(Adjacency, CountsEachPairOnce) {
  std::mt19937_64 random(17);
  for (int trial = 0; trial < 40; ++trial) {
    const auto scene = testing::random_scene(random).scene;
    std::uint64_t pairs = 0;
    for (std::uint32_t f = 0; f < scene->face_count(); ++f)
      for (std::uint32_t g = 0; g < f; ++g) pairs += adjacent(scene->faces()[f], scene->faces()[g]);
    ASSERT_EQ(count_adjacent_pairs(*scene), pairs) << trial;
  }
}

using Cover = std::map<std::tuple<ContactKind, std::uint32_t, std::uint32_t>, int>;

// How often each feature pair is tested by owners, orphan sets and isolated vertices together.
Cover covered(const Scene& scene) {
  Cover cover;
  const Ownership ownership(scene);
  const auto add = [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    if (kind == ContactKind::kEdgeEdge && b < a) std::swap(a, b);
    ++cover[{kind, a, b}];
  };
  for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
    for (std::uint32_t g = f + 1; g < scene.face_count(); ++g) {
      if (adjacent(scene.faces()[f], scene.faces()[g])) continue;
      auto [owned, perhaps] = ownership.candidates(f, g);
      for (int bit = 0; bit < 15; ++bit) {
        if ((perhaps >> bit & 1U) != 0 && ownership.owns(f, g, bit)) owned |= 1U << bit;
      }
      for (int i = 0; i < 3; ++i) {
        if (owned >> i & 1U) add(ContactKind::kVertexFace, scene.faces()[f][i], g);
        if (owned >> (3 + i) & 1U) add(ContactKind::kVertexFace, scene.faces()[g][i], f);
        for (int j = 0; j < 3; ++j) {
          if (owned >> (6 + 3 * i + j) & 1U)
            add(ContactKind::kEdgeEdge, scene.face_edges()[f][i], scene.face_edges()[g][j]);
        }
      }
    }
    for (const std::uint32_t v : scene.isolated_vertices()) add(ContactKind::kVertexFace, v, f);
  }
  const auto edges = scene.lone_edges();
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& edge = scene.edges()[edges[i]];
    for (std::size_t j = 0; j < i; ++j) {
      if (share_vertex(edge, scene.edges()[edges[j]])) continue;
      EXPECT_EQ(ownership.owned_with_segment(primitive_of_edge(EdgeId{edges[j]}), EdgeId{edges[i]}), 1U << 6);
      add(ContactKind::kEdgeEdge, edges[j], edges[i]);
    }
    for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
      if (adjacent(edge, scene.faces()[f])) continue;
      const std::uint32_t owned = ownership.owned_with_segment(primitive_of_face(f), EdgeId{edges[i]});
      for (int k = 0; k < 2; ++k)
        if (owned >> (3 + k) & 1U) add(ContactKind::kVertexFace, edge[k], f);
      for (int k = 0; k < 3; ++k)
        if (owned >> (6 + 3 * k) & 1U) add(ContactKind::kEdgeEdge, scene.face_edges()[f][k], edges[i]);
    }
  }
  const Orphans orphans = enumerate_orphans(scene);
  for (const auto& [v, f] : orphans.vertex_face) add(ContactKind::kVertexFace, number_of(v), number_of(f));
  for (const auto& [a, b] : orphans.edge_edge) add(ContactKind::kEdgeEdge, number_of(a), number_of(b));
  return cover;
}

Cover every_pair_once(const Scene& scene) {
  Cover cover;
  testing::for_all_feature_pairs(scene, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    cover[{kind, a, b}] = 1;
  });
  return cover;
}

TEST(Ownership, CoversEveryPairExactlyOnce) {
  EXPECT_EQ(covered(*testing::make_scene(49, testing::grid(6))),
            every_pair_once(*testing::make_scene(49, testing::grid(6))));
  // Far more vertices than the Bloom filters have bits.
  const auto large = testing::make_scene(21 * 21, testing::grid(20));
  EXPECT_EQ(covered(*large), every_pair_once(*large));
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    std::mt19937_64 random(seed);
    const auto [scene, positions] = testing::random_scene(random);
    ASSERT_EQ(covered(*scene), every_pair_once(*scene)) << "seed " << seed;
  }
}

// Few vertices, any three of them a face and any two an edge.
TEST(Ownership, CoversPairsOfLoneEdgesExactlyOnce) {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    std::mt19937_64 random(seed);
    const auto vertices = static_cast<std::uint32_t>(4 + random() % 8);
    testing::Faces faces(random() % 8);
    for (auto& face : faces)
      for (std::int32_t& v : face) v = static_cast<std::int32_t>(random() % vertices);
    testing::Edges edges(1 + random() % 8);
    for (auto& [a, b] : edges) {
      a = static_cast<std::int32_t>(random() % vertices);
      b = static_cast<std::int32_t>((static_cast<std::uint32_t>(a) + 1 + random() % (vertices - 1)) %
                                    vertices);
    }
    const auto scene = testing::make_scene(vertices, faces, edges);
    ASSERT_EQ(covered(*scene), every_pair_once(*scene)) << "seed " << seed;
  }
}

// Few vertices and any three of them a face: half of the faces are segments or points.
TEST(Ownership, CoversPairsOfSegmentsAndPointsExactlyOnce) {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    std::mt19937_64 random(seed);
    const auto vertices = static_cast<std::uint32_t>(3 + random() % 8);
    testing::Faces faces(1 + random() % 8);
    for (auto& face : faces)
      for (std::int32_t& v : face) v = static_cast<std::int32_t>(random() % vertices);
    for (auto& face : faces)
      if (random() % 3 == 0) face[random() % 3] = face[random() % 3];
    const auto scene = testing::make_scene(vertices, faces);
    ASSERT_EQ(covered(*scene), every_pair_once(*scene)) << "seed " << seed;
    std::uint64_t pairs = 0;
    for (std::uint32_t f = 0; f < scene->face_count(); ++f)
      for (std::uint32_t g = 0; g < f; ++g) pairs += adjacent(scene->faces()[f], scene->faces()[g]);
    ASSERT_EQ(count_adjacent_pairs(*scene), pairs) << "seed " << seed;
  }
}

}  // namespace
}  // namespace warmfront
