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
#include "engine/bvh/topology_replacement.h"
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
  if (below(5) == 0) faces.push_back({faces[at][0], faces[at][0], faces[at][1]});
  if (below(3) == 0) edges.push_back({faces[at][0], static_cast<std::int32_t>(kVertices - 1 - below(3))});
  if (below(4) == 0 && !edges.empty()) edges.erase(edges.begin());
}

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

TEST(LocalChange, ASceneMadeOfWhatItWasIsTheOneCreated) {
  std::mt19937 random(5);
  Faces faces = grid(kSide);
  Edges edges{{3, static_cast<std::int32_t>(kVertices) - 3}};
  for (int trial = 0; trial < 200; ++trial) {
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
  for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
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

// Changes one upon another, with the hierarchy that the topology has, or, every third, another one, as parts
// that have become loose get: then faces change their order.
TEST(LocalChange, WhatIsTakenOverEqualsWhatWouldBeMadeAnew) {
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
      TopologyReplacement::NewPart from;
      from.piece = &edit.piece();
      from.change = &*edit.piece().change;
      from.tests_itself = true;
      for (std::uint32_t v = part.features.first_vertex; v < part.features.end_vertex; ++v)
        from.given_vertices.push_back(
            GivenVertex{number_of(topology.numbering.given(NewVertex{v})) - part.features.first_vertex});
      const std::vector<double> own(positions.begin() + 3 * kFirst,
                                    positions.begin() + 3 * (kFirst + kVertices));
      from.positions = [&] { return own; };
      std::vector<Primitive> rearranged = part.order;
      if (change % 3 == 2) {
        std::ranges::shuffle(rearranged, random);
        from.held = {part.shape, rearranged, shared_vertices(topology.scene, part.shape, rearranged)};
      } else {
        from.held = {part.shape, part.order, part.shared};
      }
      TopologyReplacement replacement(topology, std::span(&from, 1), {}, {});
      kept_hierarchies += replacement.keeps_hierarchy(PartId{kBody}) ? 1 : 0;
      replacement.take();
      given = std::move(edit.after);
      ASSERT_NO_FATAL_FAILURE(expect_derived(topology, given));
      if (change % 3 == 2) expect_owners_of(topology.ownership, topology.scene);
    }
  }
  EXPECT_GT(kept_hierarchies, 50);
}

TEST(LocalChange, ManyChangedFacesAreNoLocalChange) {
  const Scene before = scene_of(grid(kSide), {});
  Faces faces = grid(kSide);
  for (std::size_t f = 0; f < faces.size(); f += 4) std::swap(faces[f][0], faces[f][1]);
  EXPECT_FALSE(find_local_change(before, all_of(before), faces, {}, {}));
}

TEST(LocalChange, FacesThatChangedPlacesKeepTheOrderOfMost) {
  const Scene before = scene_of(grid(kSide), {});
  Faces faces = grid(kSide);
  std::swap(faces[10], faces[700]);
  const auto change = find_local_change(before, all_of(before), faces, {}, {});
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
  EXPECT_LT(collider.memory_bytes(), after_some + after_some / 10);
  EXPECT_TRUE(collider.self_check().ok());
}

}  // namespace
}  // namespace warmfront
