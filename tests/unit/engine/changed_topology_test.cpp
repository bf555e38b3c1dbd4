// SPDX-License-Identifier: Apache-2.0
// What is made of a body that has changed locally, from what it was, equals what is made of it anew: its
// scene, renumbering, orphans, owners, hierarchy and lists of neighbours.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "engine/bvh/topology_replacement.h"
#include "engine/front/neighbours.h"
#include "engine/scene/adjacency.h"
#include "tests/unit/engine/locally_changed.h"

namespace warmfront {
namespace {

template <class T>
void expect_same(std::span<const T> one, std::span<const T> other, const char* what) {
  EXPECT_TRUE(std::ranges::equal(one, other)) << what;
}
void expect_same(const Csr& one, const Csr& other, const char* what) {
  EXPECT_EQ(one.begin, other.begin) << what;
  EXPECT_EQ(one.items, other.items) << what;
}
void expect_same(const Scene& one, const Scene& other) {
  EXPECT_EQ(one.vertex_count(), other.vertex_count());
  EXPECT_EQ(one.body_count(), other.body_count());
  expect_same(one.faces(), other.faces(), "faces");
  expect_same(one.edges(), other.edges(), "edges");
  expect_same(one.face_edges(), other.face_edges(), "face_edges");
  expect_same(one.vertex_faces(), other.vertex_faces(), "vertex_faces");
  expect_same(one.edge_faces(), other.edge_faces(), "edge_faces");
  expect_same(one.lone_edges(), other.lone_edges(), "lone_edges");
  expect_same(one.isolated_vertices(), other.isolated_vertices(), "isolated_vertices");
  expect_same(one.body_of_vertex(), other.body_of_vertex(), "body_of_vertex");
  expect_same(one.vertex_thickness(), other.vertex_thickness(), "thickness");
  for (std::uint32_t v = 0; v < one.vertex_count(); ++v)
    ASSERT_TRUE(std::ranges::equal(one.lone_edges_of(v), other.lone_edges_of(v))) << v;
}

// The sheet between two others, which do not change.
constexpr std::uint32_t kBody = 1;
constexpr std::uint32_t kFirst = 16;
constexpr std::uint32_t kHeld = 12345;  // of a budget

SceneDescription three_bodies(const Faces& faces, const Edges& edges) {
  SceneDescription description{kFirst + kVertices + 16,
                               grid(3),
                               {{"", 0, kFirst}, {"", kFirst, kVertices}, {"", kFirst + kVertices, 16}}};
  const auto add = [&](const Faces& more, std::uint32_t first) {
    const auto shift = static_cast<std::int32_t>(first);
    for (const auto& face : more)
      description.faces.push_back({face[0] + shift, face[1] + shift, face[2] + shift});
  };
  add(faces, kFirst);
  add(grid(3), kFirst + kVertices);
  for (const auto& edge : edges) description.edges.push_back({edge[0] + 16, edge[1] + 16});
  return description;
}
std::vector<double> three_sheets() {
  std::vector<double> positions = sheet();
  std::vector<double> small;
  for (int v = 0; v < 16; ++v) small.insert(small.end(), {1.0 * (v / 4), 1.0 * (v % 4), 5.0});
  positions.insert(positions.begin(), small.begin(), small.end());
  positions.insert(positions.end(), small.begin(), small.end());
  return positions;
}
Scene made(const SceneDescription& description) {
  return Scene::create(description).value();
}

// The edit that changes make of a scene, and what it says of the sheet.
struct Edit {
  Edit(const Scene& before, const Faces& faces, const Edges& edges) {
    std::vector<SceneChange> changes;
    changes.emplace_back(ReplaceElements{kBody, faces, edges});
    std::size_t failed = 0;
    after = before.with_changes(changes, failed, {}, &replaced).value();
  }
  ReplacedBodies::Piece& piece() { return replaced.pieces.front(); }

  ReplacedBodies replaced;
  Scene after;
};

TEST(ChangedTopology, ASceneMadeOfWhatItWasIsTheOneCreated) {
  std::mt19937 random(5);
  Faces faces = grid(kSide);
  Edges edges{{3, static_cast<std::int32_t>(kVertices) - 3}};
  for (int trial = 0; trial < 100; ++trial) {
    if (trial % 20 == 0) faces = grid(kSide);
    const Scene before = made(three_bodies(faces, edges));
    change_locally(faces, edges, random);
    Edit edit(before, faces, edges);
    ASSERT_TRUE(edit.piece().change.has_value());
    expect_same(edit.piece().alone, scene_of(faces, edges));
    expect_same(edit.after, made(three_bodies(faces, edges)));
  }
}

void expect_owners_of(const Ownership& owners, const Scene& scene) {
  const Ownership anew(scene);
  for (std::uint32_t f = 0; f < scene.face_count(); f += 11) {
    for (std::uint32_t g = f + 1; g < scene.face_count(); ++g) {
      if (adjacent(scene.faces()[f], scene.faces()[g])) continue;
      const auto one = owners.candidates(f, g), other = anew.candidates(f, g);
      ASSERT_EQ(one.owned, other.owned);
      ASSERT_EQ(one.perhaps, other.perhaps);
    }
  }
}

// What a topology derives from its scene, against what it would from scratch in the same order.
void expect_derived(const Topology& topology, const Scene& given) {
  std::vector<Primitive> order;
  for (const PartTopology& part : topology.parts) {
    for (const Primitive p : part.order)
      order.push_back(
          is_face(p) ? primitive_of_face(number_of(topology.numbering.given(NewFace{face_number(p)})))
          : is_point(p)
              ? primitive_of_vertex(number_of(topology.numbering.given(NewVertex{vertex_number(p)})))
              : p);
  }
  std::set<Primitive> all(order.begin(), order.end());
  EXPECT_EQ(all.size(), order.size());
  EXPECT_EQ(all.size(), given.element_count() + given.isolated_vertices().size());
  const auto vertices = topology.numbering.given_vertices();
  Renumbering numbering({vertices.begin(), vertices.end()});
  numbering.extend(given, order);
  Scene scene;
  numbering.extend(given, scene);
  expect_same(topology.scene, scene);
  EXPECT_EQ(topology.adjacent_pairs, count_adjacent_pairs(scene));
  for (const PartTopology& part : topology.parts) {
    for (BlockId b{0}; b < part.shape.end_block(); ++b) {
      EXPECT_GE(part.shape.size_of_block(b), 1u);
      EXPECT_LE(part.shape.size_of_block(b), 8u);
    }
    if (!part.has_adjacent) continue;
    const Orphans anew = enumerate_orphans(scene, part.features);
    EXPECT_EQ(part.orphans.vertex_face, anew.vertex_face);
    EXPECT_EQ(part.orphans.edge_edge, anew.edge_edge);
    EXPECT_EQ(*part.shared, *shared_vertices(scene, part.shape, part.order));
  }
}

// What a hierarchy that changes in some blocks becomes, with the neighbours listed of it before.
void expect_follows(Bvh<KDop18>& tree, const Scene& scene, const PartTopology& part,
                    std::vector<std::uint8_t>& changed_blocks) {
  std::vector<NeighbourChunk> before = list_neighbours(tree);
  for (NeighbourChunk& chunk : before) {
    for (NeighbourPair& pair : chunk.pairs) pair.budget.expiry = kHeld;
  }
  list_changed_rows(*tree.leaves.shared, *part.shared, changed_blocks);
  const std::uint32_t subtrees = tree.shape.subtree_count();
  tree.change(scene, part.shape, part.order, part.shared, changed_blocks);
  Bvh<KDop18> anew;
  anew.arrange(scene, part.shape, part.order, part.shared, true);
  EXPECT_EQ(tree.order, anew.order);
  EXPECT_EQ(tree.face_leaves.leaf, anew.face_leaves.leaf);
  EXPECT_TRUE(std::ranges::equal(tree.travel.first_corners, anew.travel.first_corners));
  ASSERT_EQ(tree.leaves.corners.size(), anew.leaves.corners.size());
  for (std::size_t b = 0; b < anew.leaves.corners.size(); ++b) {
    for (int corner = 0; corner < 3; ++corner)
      EXPECT_TRUE(
          std::ranges::equal(tree.leaves.corners[b].vertex[corner], anew.leaves.corners[b].vertex[corner]));
  }
  if (tree.shape.subtree_count() != subtrees) return;
  const std::vector<NeighbourChunk> followed = follow_neighbours(tree, before, changed_blocks, {});
  const std::vector<NeighbourChunk> listed = list_neighbours(anew);
  ASSERT_EQ(followed.size(), listed.size());
  for (std::size_t c = 0; c < listed.size(); ++c) {
    EXPECT_EQ(followed[c].leaves, listed[c].leaves);
    ASSERT_EQ(followed[c].pairs.size(), listed[c].pairs.size());
    for (std::size_t i = 0; i < listed[c].pairs.size(); ++i) {
      const NeighbourPair& one = followed[c].pairs[i];
      const NeighbourPair& other = listed[c].pairs[i];
      EXPECT_EQ(std::tuple(one.a, one.b, one.excluded), std::tuple(other.a, other.b, other.excluded));
      const bool stays = (changed_blocks[number_of(one.a)] | changed_blocks[number_of(one.b)]) == 0;
      EXPECT_EQ(one.budget.expiry, stays ? kHeld : other.budget.expiry);
    }
  }
}

// The sheet, which keeps its vertices and its hierarchy.
TopologyReplacement::NewPart sheet_changed(const Topology& topology, Edit& edit) {
  const PartTopology& part = topology.parts[kBody];
  TopologyReplacement::NewPart from;
  from.piece = &edit.piece();
  from.change = &*edit.piece().change;
  from.tests_itself = true;
  for (std::uint32_t v = part.features.first_vertex; v < part.features.end_vertex; ++v)
    from.given_vertices.push_back(
        GivenVertex{number_of(topology.numbering.given(NewVertex{v})) - part.features.first_vertex});
  from.positions = sheet;
  from.held = {part.shape, part.order, part.shared};
  return from;
}

// As many faces came as went, each where one went: no other face gets another number.
TEST(ChangedTopology, APatchWithOtherDiagonalsLeavesAllElseWhereItIs) {
  std::mt19937 random(23);
  for (int trial = 0; trial < 20; ++trial) {
    Faces faces = grid(kSide);
    const Scene before = made(three_bodies(faces, {}));
    const Motion motion(three_sheets());
    Topology topology(before, motion, 64, false);
    topology.need_adjacent(PartId{kBody});
    const Renumbering numbering = topology.numbering;
    const std::size_t width = 2 + random() % 8;
    const std::size_t row = random() % (kSide - width), column = random() % (kSide - width);
    for (std::size_t i = row; i < row + width; ++i) {
      for (std::size_t j = column; j < column + width; ++j) {
        auto* const two = faces.data() + 2 * (i * kSide + j);
        const auto corner = [&](std::size_t a, std::size_t b) {
          return static_cast<std::int32_t>((i + a) * (kSide + 1) + j + b);
        };
        const auto has = [&](std::int32_t v) { return std::ranges::find(two[0], v) != two[0].end(); };
        if (has(corner(0, 0)) && has(corner(1, 1))) {
          two[0] = {corner(0, 0), corner(1, 0), corner(0, 1)};
          two[1] = {corner(1, 0), corner(1, 1), corner(0, 1)};
        } else {
          two[0] = {corner(0, 0), corner(1, 0), corner(1, 1)};
          two[1] = {corner(0, 0), corner(1, 1), corner(0, 1)};
        }
      }
    }
    Edit edit(before, faces, {});
    ASSERT_TRUE(edit.piece().change.has_value());
    const TopologyReplacement::NewPart from = sheet_changed(topology, edit);
    TopologyReplacement replacement(topology, std::span(&from, 1), {}, {});
    ASSERT_TRUE(replacement.keeps_hierarchy(PartId{kBody}));
    replacement.take();
    std::uint32_t same = 0;
    for (std::uint32_t f = 0; f < before.face_count(); ++f) {
      if (before.faces()[f] != edit.after.faces()[f]) continue;
      ASSERT_EQ(topology.numbering.renumbered(GivenFace{f}), numbering.renumbered(GivenFace{f}));
      ++same;
    }
    EXPECT_EQ(same, before.face_count() - 2 * width * width);
  }
}

// Changes one upon another, with the hierarchy that the topology has, or, every third, another one, as parts
// that have become loose get: then faces change their order.
TEST(ChangedTopology, WhatIsTakenOverEqualsWhatWouldBeMadeAnew) {
  std::mt19937 random(7);
  Faces faces = grid(kSide);
  Edges edges{{3, static_cast<std::int32_t>(kVertices) - 3}};
  const std::vector<double> positions = three_sheets();
  int kept_hierarchies = 0;
  for (int trial = 0; trial < 12; ++trial) {
    faces = grid(kSide);
    Scene given = made(three_bodies(faces, edges));
    const Motion motion(positions);
    Topology topology(given, motion, 64, false);
    topology.need_adjacent(PartId{kBody});
    for (int change = 0; change < 6; ++change) {
      change_locally(faces, edges, random);
      Edit edit(given, faces, edges);
      ASSERT_TRUE(edit.piece().change.has_value());
      const PartTopology& part = topology.parts[kBody];
      TopologyReplacement::NewPart from = sheet_changed(topology, edit);
      std::vector<Primitive> rearranged = part.order;
      if (change % 3 == 2) {
        std::ranges::shuffle(rearranged, random);
        from.held = {part.shape, rearranged, shared_vertices(topology.scene, part.shape, rearranged)};
      }
      Bvh<KDop18> tree;
      tree.arrange(topology.scene, part.shape, {from.held.order.begin(), from.held.order.end()},
                   from.held.shared, true);
      TopologyReplacement replacement(topology, std::span(&from, 1), {}, {});
      std::vector<std::uint8_t> blocks = replacement.changed_blocks(PartId{kBody});
      kept_hierarchies += replacement.keeps_hierarchy(PartId{kBody}) ? 1 : 0;
      replacement.take();
      given = std::move(edit.after);
      ASSERT_NO_FATAL_FAILURE(expect_derived(topology, given));
      if (!blocks.empty()) expect_follows(tree, topology.scene, topology.parts[kBody], blocks);
      if (change % 3 == 2) expect_owners_of(topology.ownership, topology.scene);
    }
  }
  EXPECT_GT(kept_hierarchies, 50);
}

}  // namespace
}  // namespace warmfront
