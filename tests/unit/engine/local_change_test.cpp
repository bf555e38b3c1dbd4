// SPDX-License-Identifier: Apache-2.0
// Local changes of a body's elements: what counts as one, and that answers are those of a new collider.
#include "engine/scene/local_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "engine/collider.h"
#include "tests/support/scenes.h"
#include "tests/unit/engine/locally_changed.h"

namespace warmfront {
namespace {

TEST(LocalChange, ManyChangedFacesAreNoLocalChange) {
  const Scene before = scene_of(grid(kSide), {});
  Faces faces = grid(kSide);
  for (std::size_t f = 0; f < faces.size(); f += 4) std::swap(faces[f][0], faces[f][1]);
  EXPECT_FALSE(find_local_change(before, all_of(before), faces, {}, {}));
}

TEST(LocalChange, ManyChangedEdgesOfNoFaceAreNone) {
  Edges edges;
  for (std::int32_t v = 1; v < 800; ++v) edges.push_back({v - 1, v});
  const Scene before = scene_of({}, edges);
  const auto is_local = [&](const Edges& now) {
    return find_local_change(before, all_of(before), {}, now, {}).has_value();
  };
  EXPECT_TRUE(is_local(edges));
  Edges others = edges;
  for (auto& edge : others) edge[1] += 1;
  EXPECT_FALSE(is_local(others));
  EXPECT_FALSE(is_local({}));
  Edges fewer(edges.begin() + 50, edges.end());
  EXPECT_TRUE(is_local(fewer));
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
  for (int step = 1; step <= 40; ++step) {
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

// The other diagonal for the quads of a square patch.
void flip(Faces& faces, int side, int first_row, int first_column, int width) {
  for (int i = first_row; i < first_row + width; ++i) {
    for (int j = first_column; j < first_column + width; ++j) {
      auto* const two = faces.data() + 2 * (static_cast<std::size_t>(i) * side + j);
      const auto corner = [&](int a, int b) { return (i + a) * (side + 1) + j + b; };
      const bool other = std::ranges::find(two[0], corner(0, 0)) != two[0].end() &&
                         std::ranges::find(two[0], corner(1, 1)) != two[0].end();
      two[0] = {corner(0, 0), corner(1, 0), other ? corner(0, 1) : corner(1, 1)};
      two[1] = {other ? corner(1, 0) : corner(0, 0), corner(1, 1), corner(0, 1)};
    }
  }
}

// As many come as go, so that no blocks fill up while others empty.
TEST(LocalChange, AHierarchyOutlastsHundredsOfChanges) {
  constexpr int kQuads = 120, kWide = 8;
  constexpr std::uint32_t kAll = (kQuads + 1) * (kQuads + 1);
  Faces faces = grid(kQuads);
  std::vector<double> at;
  for (std::uint32_t v = 0; v < kAll; ++v)
    at.insert(at.end(), {1.0 * (v / (kQuads + 1)), 1.0 * (v % (kQuads + 1)), 0.0});
  Collider collider =
      Collider::create(std::make_shared<const Scene>(
                           Scene::create(SceneDescription{kAll, faces, {{"", 0, kAll}}}).value()),
                       std::span<const double>(at), {}, std::make_shared<Workers>(1))
          .value();
  int rebuilt = 0;
  for (int i = 1; i <= 300; ++i) {
    for (int patch = 0; patch < 4; ++patch) {
      const int first = (37 * i + 101 * patch) % (kQuads - kWide);
      flip(faces, kQuads, first, 7 * first % (kQuads - kWide), kWide);
    }
    ASSERT_TRUE(collider.replace_elements(0, faces, {}).ok());
    for (std::size_t z = 2; z < at.size(); z += 3) at[z] += i % 2 == 0 ? 0.01 : -0.01;
    const StepResult result = collider.step(std::span<const double>(at)).value();
    rebuilt += result.statistics.rebuild != Rebuild::kNone ? 1 : 0;
  }
  EXPECT_LE(rebuilt, 1);
  EXPECT_TRUE(collider.self_check().ok());
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
