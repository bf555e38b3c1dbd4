// SPDX-License-Identifier: Apache-2.0
// Replaced elements and bodies: what the numbering rule says, what is refused and how, that contacts are
// those of a collider made anew, and that many changes leave a scene as large as a few.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using testing::grid;
using ::testing::HasSubstr;

// n x n quads of side 1 at a height.
std::vector<double> sheet(int n, double height) {
  std::vector<double> positions;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) positions.insert(positions.end(), {1.0 * i / n, 1.0 * j / n, height});
  }
  return positions;
}
BodyAddition body_of(int n) {
  BodyAddition body{{}, grid(n)};
  body.body.vertex_count = static_cast<std::uint32_t>((n + 1) * (n + 1));
  return body;
}

// SheetStack above each other, of n[i] x n[i] quads each.
struct SheetStack {
  SceneDescription scene;
  std::vector<double> positions;

  explicit SheetStack(const std::vector<int>& quads) {
    for (const int n : quads) {
      BodyAddition body = body_of(n);
      const auto first = static_cast<std::int32_t>(scene.vertex_count);
      for (const auto& [a, b, c] : body.faces) scene.faces.push_back({a + first, b + first, c + first});
      body.body.first_vertex = scene.vertex_count;
      scene.vertex_count += body.body.vertex_count;
      const std::vector<double> at = sheet(n, 0.1 * static_cast<double>(scene.bodies.size()));
      positions.insert(positions.end(), at.begin(), at.end());
      scene.bodies.push_back(body.body);
    }
  }
};

const std::shared_ptr<Workers>& one_worker() {
  static const auto one = std::make_shared<Workers>(1);
  return one;
}
Collider stacked_collider(SceneDescription scene, const std::vector<double>& positions,
                          const ColliderOptions& options = {}) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(std::move(scene)).value()),
                          std::span<const double>(positions), options, one_worker())
      .value();
}

std::vector<double> squeezed(std::vector<double> positions, double factor) {
  for (std::size_t z = 2; z < positions.size(); z += 3) positions[z] *= factor;
  return positions;
}

void expect_same_scene(const Scene& a, const Scene& b) {
  EXPECT_TRUE(std::ranges::equal(a.faces(), b.faces()));
  EXPECT_TRUE(std::ranges::equal(a.edges(), b.edges()));
  EXPECT_TRUE(std::ranges::equal(a.face_edges(), b.face_edges()));
  EXPECT_TRUE(std::ranges::equal(a.lone_edges(), b.lone_edges()));
  EXPECT_TRUE(std::ranges::equal(a.isolated_vertices(), b.isolated_vertices()));
  EXPECT_TRUE(std::ranges::equal(a.body_of_vertex(), b.body_of_vertex()));
  EXPECT_TRUE(std::ranges::equal(a.bodies(), b.bodies()));
  EXPECT_EQ(a.vertex_faces().items, b.vertex_faces().items);
  EXPECT_EQ(a.vertex_faces().begin, b.vertex_faces().begin);
  EXPECT_EQ(a.edge_faces().items, b.edge_faces().items);
  EXPECT_EQ(a.edge_faces().begin, b.edge_faces().begin);
}

// Both step to sheets that pass through each other.
void expect_same_contacts(Collider& warm, Collider& fresh, double factor) {
  const std::vector<double> to = squeezed(warm.positions(), factor);
  ASSERT_EQ(warm.positions(), fresh.positions());
  const StepResult one = warm.step(std::span<const double>(to)).value();
  const StepResult other = fresh.step(std::span<const double>(to)).value();
  EXPECT_GT(one.contacts.size(), 0u);
  EXPECT_TRUE(std::ranges::equal(one.contacts, other.contacts));
  EXPECT_TRUE(warm.self_check().ok());
}

TEST(Replace, ABodyShiftsTheNumbersOfThoseAfterIt) {
  const SheetStack before({3, 4, 5}), after({3, 6, 5});
  Collider collider = stacked_collider(before.scene, before.positions);
  const std::vector<double> moved = squeezed(before.positions, 0.9);
  ASSERT_TRUE(collider.step(std::span<const double>(moved)).ok());
  const std::vector<double> at = squeezed(sheet(6, 0.1), 0.9);
  ASSERT_TRUE(collider.replace_body(1, body_of(6), std::span<const double>(at)).ok());
  EXPECT_EQ(collider.scene().bodies()[1].first_vertex, 16u);
  EXPECT_EQ(collider.scene().bodies()[1].vertex_count, 49u);
  EXPECT_EQ(collider.scene().bodies()[2].first_vertex, 65u);
  Collider fresh = stacked_collider(after.scene, squeezed(after.positions, 0.9));
  expect_same_scene(collider.scene(), fresh.scene());
  expect_same_contacts(collider, fresh, -1);
}

TEST(Replace, FacesInTurnsAreOrderedByBody) {
  SheetStack mixed({2, 3});
  const SheetStack ordered({2, 3});
  std::ranges::reverse(mixed.scene.faces);
  std::rotate(mixed.scene.faces.begin(), mixed.scene.faces.begin() + 5, mixed.scene.faces.end());
  Collider collider = stacked_collider(mixed.scene, mixed.positions);
  ASSERT_TRUE(collider.replace_elements(0, grid(2)).ok());
  std::ranges::stable_sort(mixed.scene.faces, {}, [](const auto& face) { return face[0] >= 9; });
  std::ranges::copy(grid(2), mixed.scene.faces.begin());
  Collider fresh = stacked_collider(mixed.scene, mixed.positions);
  expect_same_scene(collider.scene(), fresh.scene());
  expect_same_contacts(collider, fresh, -1);
}

TEST(Replace, ElementsLeaveVerticesWhereTheyAre) {
  const SheetStack sheets({3, 3});
  Collider collider = stacked_collider(sheets.scene, sheets.positions);
  const std::vector<double> moved = squeezed(sheets.positions, 0.5);
  ASSERT_TRUE(collider.step(std::span<const double>(moved)).ok());
  testing::Faces torn = grid(3);
  torn.resize(torn.size() / 2);
  ASSERT_TRUE(collider.replace_elements(1, torn, {{14, 15}, {0, 15}}).ok());
  EXPECT_EQ(collider.positions(), moved);
  EXPECT_EQ(collider.scene().lone_edges().size(), 2u);
  SceneDescription after = sheets.scene;
  after.faces.resize(18);
  for (const auto& [a, b, c] : torn) after.faces.push_back({a + 16, b + 16, c + 16});
  after.edges = {{30, 31}, {16, 31}};
  Collider fresh = stacked_collider(after, moved);
  expect_same_scene(collider.scene(), fresh.scene());
  expect_same_contacts(collider, fresh, -1);
}

TEST(Replace, WithoutDeclaredBodiesAllOfIt) {
  SheetStack sheets({3, 3});
  sheets.scene.bodies.clear();
  Collider collider = stacked_collider(sheets.scene, sheets.positions);
  sheets.scene.faces.erase(sheets.scene.faces.begin(), sheets.scene.faces.begin() + 4);
  EXPECT_THAT(collider.replace_elements(1, sheets.scene.faces).error().message,
              HasSubstr("index 0 is all of it"));
  ASSERT_TRUE(collider.replace_elements(0, sheets.scene.faces).ok());
  Collider fresh = stacked_collider(sheets.scene, sheets.positions);
  expect_same_scene(collider.scene(), fresh.scene());
  expect_same_contacts(collider, fresh, -1);
  const std::vector<double> at = sheet(2, 0);
  const Status refused = collider.replace_body(0, body_of(2), std::span<const double>(at));
  EXPECT_EQ(refused.error().code, ErrorCode::kFailedPrecondition);
}

TEST(Replace, ARemovedBodyLeavesNothingAndItsIndexIsUsedAgain) {
  const SheetStack sheets({3, 4, 5});
  Collider collider = stacked_collider(sheets.scene, sheets.positions);
  BodyAddition gone;
  gone.body.kind = BodyKind::kRemoved;
  ASSERT_TRUE(collider.replace_body(1, gone, std::span<const double>()).ok());
  EXPECT_EQ(collider.scene().vertex_count(), 16u + 36u);
  EXPECT_EQ(collider.scene().body_count(), 3u);
  const std::vector<double> to = squeezed(collider.positions(), -1);
  const StepResult result = collider.step(std::span<const double>(to)).value();
  EXPECT_GT(result.contacts.size(), 0u);
  EXPECT_FALSE(collider.change_body(1, {"", 0, 0, BodyKind::kRigid}).ok());
  EXPECT_FALSE(collider.replace_elements(1, {}).ok());
  const std::vector<double> at = sheet(4, -0.1);
  ASSERT_TRUE(collider.replace_body(1, body_of(4), std::span<const double>(at)).ok());
  EXPECT_EQ(collider.scene().vertex_count(), sheets.scene.vertex_count);
  Collider fresh = stacked_collider(sheets.scene, collider.positions());
  expect_same_scene(collider.scene(), fresh.scene());
  expect_same_contacts(collider, fresh, -1);
}

TEST(Replace, WhatDoesNotFitIsRefusedAndNothingChanges) {
  SheetStack sheets({3, 4});
  sheets.scene.thickness.assign(sheets.scene.vertex_count, 0.0);
  sheets.scene.thickness[20] = 0.01;
  sheets.scene.filters.excluded_vertex_pairs = {{0, 17}};
  Collider collider = stacked_collider(sheets.scene, sheets.positions);
  const std::vector<double> at = sheet(2, 0), wrong = sheet(3, 0);
  const auto refused = [&](const Status& status, ErrorCode code, const char* says) {
    ASSERT_FALSE(status.ok()) << says;
    EXPECT_EQ(status.error().code, code);
    EXPECT_THAT(status.error().message, HasSubstr(says));
  };
  const auto replace = [&](std::uint32_t index, BodyAddition body, const std::vector<double>& positions) {
    return collider.replace_body(index, std::move(body), std::span<const double>(positions));
  };
  using enum ErrorCode;
  refused(replace(2, body_of(2), at), kInvalidArgument, "index: body 2 is not in [0, 2); give the");
  refused(replace(1, body_of(2), at), kFailedPrecondition, "thickness");
  BodyAddition thick = body_of(2);
  thick.thickness.assign(9, 0.01);
  refused(replace(1, thick, at), kFailedPrecondition, "excluded_vertex_pairs[0] names vertex 17");
  ASSERT_TRUE(collider.change_filters({}).ok());
  refused(replace(1, thick, wrong), kInvalidArgument, "positions");
  thick.thickness.pop_back();
  refused(replace(1, thick, at), kInvalidArgument, "thickness: 8 values for 9");
  thick.thickness.push_back(0);
  thick.faces.push_back({0, 1, 9});
  refused(replace(1, thick, at), kInvalidArgument,
          "bodies[1]: faces[8][2]: vertex index 9 is not in [0, 9); a body's");
  thick.faces.pop_back();
  thick.body.kind = BodyKind::kRemoved;
  refused(replace(1, thick, at), kInvalidArgument, "no vertices and no positions");
  refused(collider.replace_elements(1, {{0, 1, 25}}), kInvalidArgument, "bodies[1]: faces[0][2]");
  refused(collider.replace_elements(1, {}, {{25, 7}}), kInvalidArgument,
          "bodies[1]: edges[0][0]: vertex index 25 is not in [0, 25); a body's faces and edges number its "
          "own vertices, from 0");
  refused(collider.replace_elements(0, {}, {{3, 3}}), kInvalidArgument, "to itself");
  EXPECT_EQ(collider.positions(), sheets.positions);
  thick.body.kind = BodyKind::kDeformable;
  EXPECT_TRUE(replace(1, thick, at).ok());
  EXPECT_EQ(collider.scene().thickness_of(24), 0);
  EXPECT_EQ(collider.scene().thickness_of(16), 0.01);
}

// A half-space has no rest shape that it could be given with.
TEST(Replace, AHalfSpaceIsAddedBesideFiltersThatGoByTheRestShape) {
  SheetStack stack({2});
  stack.scene.filters.near_at_rest = 0.1;
  stack.scene.filters.rest_positions = stack.positions;
  Collider collider = stacked_collider(stack.scene, stack.positions);
  BodyAddition ground;
  ground.body.kind = BodyKind::kStatic;
  ground.body.half_space = HalfSpace{{0, 0, -0.5}, {0, 0, 1}};
  const auto added = collider.add_body(ground, std::span<const double>());
  ASSERT_TRUE(added.ok()) << added.error().message;
  const std::vector<double> below = sheet(2, -1);
  EXPECT_EQ(collider.step(std::span<const double>(below)).value().vh, 9U);
  EXPECT_TRUE(collider.self_check().ok());
}

TEST(Replace, OthersStayWarm) {
  const SheetStack sheets(std::vector<int>(12, 8));
  ColliderOptions options;
  options.lazy_front = false;
  options.min_separation = 0.05;
  Collider collider = stacked_collider(sheets.scene, sheets.positions, options);
  std::vector<double> to = squeezed(sheets.positions, 0.99);
  ASSERT_TRUE(collider.step(std::span<const double>(to)).ok());
  const std::vector<double> at = squeezed(sheet(7, 0.3), 0.99);
  ASSERT_TRUE(collider.replace_body(3, body_of(7), std::span<const double>(at)).ok());
  to = squeezed(collider.positions(), 0.99);
  const StepResult result = collider.step(std::span<const double>(to)).value();
  EXPECT_EQ(result.statistics.front_state, FrontState::kUpdated);
  EXPECT_TRUE(collider.self_check().ok());
}

TEST(Replace, TenThousandTimesLeavesASceneAsLargeAsTen) {
  const SheetStack sheets({6, 6});
  Collider collider = stacked_collider(sheets.scene, sheets.positions);
  std::size_t after_ten = 0;
  for (int i = 1; i <= 10'000; ++i) {
    const int n = 5 + i % 3;
    const std::vector<double> at = sheet(n, 0.1 + 0.01 * (i % 2));
    ASSERT_TRUE(collider.replace_body(1, body_of(n), std::span<const double>(at)).ok());
    if (i % 4 == 0) {
      const std::vector<double> to = squeezed(collider.positions(), i % 8 == 0 ? 1.01 : 0.99);
      ASSERT_TRUE(collider.step(std::span<const double>(to)).ok());
    }
    if (i == 16) after_ten = collider.memory_bytes();
  }
  EXPECT_LT(collider.memory_bytes(), after_ten + after_ten / 50);
  EXPECT_TRUE(collider.self_check().ok());
}

}  // namespace
}  // namespace warmfront
