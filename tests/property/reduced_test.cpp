// SPDX-License-Identifier: Apache-2.0
// Reduced answers of proximity: those of random scenes against an oracle that groups all rows one by one, for
// any threads, warm and cold; scenes whose closest pairs are known; what is refused; the vertices of each
// closest pair; and the rows of each vertex against brute force.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>
#include <string>

#include "engine/collider.h"
#include "engine/rows_by_vertex.h"
#include "engine/stencil.h"
#include "tests/support/brute_force.h"
#include "tests/support/reduced_oracle.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;

const QuestionOptions kReduced{.reduced = true};

std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

template <class T>
std::vector<T> list(std::span<const T> rows) {
  return {rows.begin(), rows.end()};
}

// Of rows, what each vertex is in, one look at a time.
std::vector<std::vector<std::uint32_t>> brute_force_by_vertex(
    const std::vector<std::array<std::uint32_t, 4>>& rows, std::uint32_t vertex_count) {
  std::vector<std::vector<std::uint32_t>> by_vertex(vertex_count);
  for (std::uint32_t v = 0; v < vertex_count; ++v)
    for (std::uint32_t row = 0; row < rows.size(); ++row)
      if (std::ranges::count(rows[row], v) > 0) by_vertex[v].push_back(row);
  return by_vertex;
}

RC_GTEST_PROP(Reduced, IsAllRowsGroupedByTheirClosestFeatures, ()) {
  std::mt19937_64 random = draw_random();
  const testing::RandomScene made = testing::random_scene(random);
  ColliderOptions options;
  options.front = static_cast<FrontMode>(random() % 3);
  options.leaf_size = random() % 2 == 0 ? 64 : 1;
  options.tier = random() % 2 == 0 ? Tier::kExact : Tier::kCertified;
  const auto make = [&](const std::vector<double>& at, const std::shared_ptr<Workers>& workers) {
    return Collider::create(made.scene, std::span<const double>(at), options, workers).value();
  };
  Collider warm = make(made.positions, testing::workers());
  std::vector<double> x = made.positions;
  static const auto one = std::make_shared<Workers>(1);
  static const auto four = std::make_shared<Workers>(4);
  for (int k = 0; k < 3; ++k) {
    const double distance = std::array{0.0, 0.02, 0.1, 0.5}[random() % 4];
    const std::vector<double> y = testing::random_motion(random, *made.scene, x);
    RC_ASSERT(warm.trial(std::span<const double>(y)).ok());
    for (const Where where : {Where::kBase, Where::kTrialEnd}) {
      const auto vertices = testing::motion_between(x, y);
      const StepResult all = warm.proximity(distance, where).value();
      const auto expected = testing::reduced_oracle(*made.scene, vertices, all.contacts);
      const std::tuple counts(all.vf, all.ee, all.possible);
      QuestionOptions question = kReduced;
      if (random() % 2 == 0) question.fields = ContactFields{.weights = true, .closest = true};
      const StepResult reduced = warm.proximity(distance, where, question).value();
      RC_ASSERT(list(reduced.contacts) == expected.contacts);
      RC_ASSERT(list(reduced.closest_pairs) == expected.closest_pairs);
      RC_ASSERT(std::tuple(reduced.vf, reduced.ee, reduced.possible) == counts);
      std::uint64_t multiplicities = 0;
      std::vector<std::array<std::uint32_t, 4>> rows;
      for (std::size_t i = 0; i < reduced.contacts.size(); ++i) {
        multiplicities += reduced.closest_pairs[i].multiplicity;
        rows.push_back(made.scene->vertices_of(reduced.contacts[i]));
        if (!question.fields) continue;
        const Stencil stencil =
            stencil_of(reduced.contacts[i].kind, rows[i], reduced.closest_pairs[i].stencil);
        RC_ASSERT(stencil.kind == reduced.geometry[i].closest || stencil.kind == ClosestFeatures::kEdgeEdge);
      }
      RC_ASSERT(multiplicities == reduced.vf + reduced.ee);
      RC_ASSERT(reduced.geometry.size() == (question.fields ? rows.size() : 0));

      const RowsByVertex by_vertex = rows_by_vertex(reduced.contacts, *made.scene).value();
      const auto truth = brute_force_by_vertex(rows, made.scene->vertex_count());
      for (std::uint32_t v = 0; v < truth.size(); ++v) RC_ASSERT(list(by_vertex[v]) == truth[v]);
      RC_ASSERT(rows_by_vertex(rows, made.scene->vertex_count()).value() == by_vertex);

      Collider cold = make(x, random() % 2 == 0 ? one : four);
      RC_ASSERT(cold.trial(std::span<const double>(y)).ok());
      const StepResult again = cold.proximity(distance, where, question).value();
      RC_ASSERT(list(again.contacts) == expected.contacts);
      RC_ASSERT(list(again.closest_pairs) == expected.closest_pairs);
    }
    RC_ASSERT(warm.commit(1).ok());
    x = y;
  }
}

/// For example "vv 0 5 x3".
std::string text_of(const char* kind, const std::vector<int>& vertices, int multiplicity) {
  std::ostringstream text;
  text << kind;
  for (const int v : vertices) text << ' ' << v;
  text << " x" << multiplicity;
  return text.str();
}

// Scenes whose closest pairs are known.
class Known {
 public:
  Known(std::vector<double> positions, testing::Faces faces)
      : positions_(std::move(positions)),
        scene_(testing::make_scene(static_cast<std::uint32_t>(positions_.size() / 3), std::move(faces))),
        collider_(
            Collider::create(scene_, std::span<const double>(positions_), {}, testing::workers()).value()) {}

  /// As text_of() says.
  std::multiset<std::string> reduced(double distance) {
    const StepResult answer = collider_.proximity(distance, Where::kBase, kReduced).value();
    std::multiset<std::string> told;
    for (std::size_t i = 0; i < answer.contacts.size(); ++i) {
      const ClosestPair& pair = answer.closest_pairs[i];
      const Stencil stencil =
          stencil_of(answer.contacts[i].kind, scene_->vertices_of(answer.contacts[i]), pair.stencil);
      const char* kind = std::array{"vv", "ev", "ee", "fv"}[static_cast<int>(stencil.kind)];
      std::vector<int> vertices(stencil.vertices.begin(), stencil.vertices.begin() + stencil.size);
      if (stencil.size == 2) std::ranges::sort(vertices);
      told.insert(text_of(kind, vertices, static_cast<int>(pair.multiplicity)));
    }
    return told;
  }
  Collider& collider() { return collider_; }

 private:
  std::vector<double> positions_;
  std::shared_ptr<const Scene> scene_;
  Collider collider_;
};

// A fan of n faces around vertex 0 that falls away from it, and a triangle whose corner is above.
Known fan(int n) {
  std::vector<double> x{0, 0, 0};
  testing::Faces faces;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / n;
    x.insert(x.end(), {std::cos(angle), std::sin(angle), -1});
    faces.push_back({0, 1 + k, 1 + (k + 1) % n});
  }
  x.insert(x.end(), {0, 0, 0.1, 1, 0, 3, 0, 1, 3});
  faces.push_back({n + 1, n + 2, n + 3});
  return {std::move(x), std::move(faces)};
}

TEST(Reduced, AVertexOverAHubIsOneVertexVertexPair) {
  for (const int n : {3, 6, 50}) {
    // Of the vertex n faces; of the hub one; and each of n edges with both at the corner.
    const auto told = fan(n).reduced(0.11);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(*told.begin(), text_of("vv", {0, n + 1}, n + 1 + 2 * n));
  }
}

// Two faces that share edge 0-1, a roof, and a triangle whose corner is above the middle of the edge.
TEST(Reduced, AVertexOverAnEdgeIsOneEdgeVertexPair) {
  Known roof({-1, 0, 0, 1, 0, 0, 0, 1, -1, 0, -1, -1, 0, 0, 0.1, 0.2, 1, 3, -0.2, -1, 3},
             {{0, 1, 2}, {1, 0, 3}, {4, 5, 6}});
  // Both faces, and both edges at the corner, which are not parallel to it.
  EXPECT_EQ(roof.reduced(0.11), (std::multiset<std::string>{"ev 0 1 4 x4"}));
}

TEST(Reduced, CrossedEdgesAreThemselves) {
  Known crossed({-1, 0, 0, 1, 0, 0, 0, 0, -5, 0, -1, 0.1, 0, 1, 0.1, 0, 0, 5}, {{0, 1, 2}, {3, 4, 5}});
  EXPECT_EQ(crossed.reduced(0.11), (std::multiset<std::string>{"ee 0 1 3 4 x1"}));
}

TEST(Reduced, ParallelEdgesKeepARowOfTheirOwn) {
  // Edges 0-1 and 3-4 above each other; each end is nearest to the other edge's end, too.
  for (const double turn : {0.0, 0.01, 0.2}) {
    Known edges({-1, 0, 0, 1, 0, 0, 0, 0, -5, -1, -turn, 0.1, 1, turn, 0.1, 0, 0, 5}, {{0, 1, 2}, {3, 4, 5}});
    const auto told = edges.reduced(0.15);
    if (turn < 0.1)
      EXPECT_EQ(told.count("ee 0 1 3 4 x1"), 1u) << turn;
    else
      EXPECT_EQ(told, (std::multiset<std::string>{"ee 0 1 3 4 x1"})) << "crossed, and their ends far apart";
  }
  // Behind one another, so that their ends are closest: a pair of these vertices that is not summed with
  // others.
  Known behind({0, 0, 0, 1, 0, 0, 0, 0, -5, 1.1, 0, 0, 2, 0, 0, 5, 0, 5}, {{0, 1, 2}, {3, 4, 5}});
  QuestionOptions closest = kReduced;
  closest.fields = ContactFields{.closest = true};
  const StepResult answer = behind.collider().proximity(0.11, Where::kBase, closest).value();
  ASSERT_GE(answer.contacts.size(), 2u);
  std::uint64_t alone = 0, pairs = 0;
  for (std::size_t i = 0; i < answer.contacts.size(); ++i) {
    EXPECT_EQ(answer.geometry[i].closest, ClosestFeatures::kVertexVertex) << "as it is";
    const bool parallel = answer.closest_pairs[i].stencil == 0b1111;
    EXPECT_TRUE(!parallel || answer.closest_pairs[i].multiplicity == 1);
    alone += parallel ? 1 : 0;
    pairs += parallel ? 0 : 1;
  }
  EXPECT_EQ(alone, 1u);
  EXPECT_EQ(pairs, 1u);
}

TEST(Reduced, VerticesThatCoincideStayTwo) {
  // Two triangles of their own vertices, which are at the same places.
  Known twice({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0}, {{0, 1, 2}, {3, 4, 5}});
  const auto told = twice.reduced(0);
  for (int v = 0; v < 3; ++v)
    EXPECT_TRUE(std::ranges::any_of(told, [&](const std::string& text) {
      return text.starts_with(text_of("vv", {v, v + 3}, 0).substr(0, 6));
    })) << v;
  EXPECT_TRUE(std::ranges::none_of(told, [](const std::string& text) { return text.starts_with("fv"); }));
}

TEST(Reduced, StencilsHaveTheirVerticesInTheOrderOfTheLetters) {
  const std::array<std::uint32_t, 4> v{10, 11, 12, 13};
  const auto vf = ContactKind::kVertexFace, ee = ContactKind::kEdgeEdge;
  const auto vertices = [&](ContactKind kind, std::uint8_t bits) {
    return stencil_of(kind, v, bits).vertices;
  };
  using Four = std::array<std::uint32_t, 4>;
  EXPECT_EQ(vertices(vf, 0b1111), (Four{11, 12, 13, 10}));
  EXPECT_EQ(vertices(vf, 0b1101), (Four{12, 13, 10, 0}));
  EXPECT_EQ(vertices(vf, 0b0101), (Four{10, 12, 0, 0}));
  EXPECT_EQ(vertices(ee, 0b1111), v);
  EXPECT_EQ(vertices(ee, 0b1011), (Four{10, 11, 13, 0}));
  EXPECT_EQ(vertices(ee, 0b1110), (Four{12, 13, 11, 0}));
  EXPECT_EQ(vertices(ee, 0b0110), (Four{11, 12, 0, 0}));
}

TEST(Reduced, IsOfProximityAlone) {
  Known scene = fan(5);
  Collider& collider = scene.collider();
  const std::vector<double> x = collider.positions();
  const auto refused = [](const auto& result) {
    return result.ok() || result.error().code != ErrorCode::kInvalidArgument ? std::string()
                                                                             : result.error().message;
  };
  const std::span<const double> still = x;
  EXPECT_THAT(refused(collider.step(still, nullptr, {}, kReduced)), HasSubstr("reduced: "));
  EXPECT_THAT(refused(collider.trial(still, kReduced)), HasSubstr("reduced: "));
  EXPECT_THAT(refused(collider.max_step(still, false, kReduced)), HasSubstr("reduced: "));
  EXPECT_THAT(refused(collider.intersections(Where::kBase, kReduced)), HasSubstr("reduced: "));
  EXPECT_THAT(refused(collider.vertex_distances(0.1, Where::kBase, kReduced)), HasSubstr("reduced: "));
  EXPECT_THAT(
      refused(Collider::create(collider.shared_scene(), still, {.reduced = true}, testing::workers())),
      HasSubstr("reduced: "));
  const StepResult counted =
      collider.proximity(0.11, Where::kBase, {.report = Report::kCount, .reduced = true}).value();
  EXPECT_EQ(counted.vf + counted.ee, 16u);
  EXPECT_TRUE(counted.contacts.empty() && counted.closest_pairs.empty());
  // Its bound is on what is held while it is reduced.
  EXPECT_EQ(collider.proximity(0.11, Where::kBase, {.max_contacts = 15, .reduced = true}).error().code,
            ErrorCode::kResourceExhausted);
  EXPECT_EQ(
      collider.proximity(0.11, Where::kBase, {.max_contacts = 16, .reduced = true}).value().contacts.size(),
      1u);
  EXPECT_TRUE(collider.proximity(0.11).value().closest_pairs.empty());
}

TEST(RowsByVertex, RefusesAVertexThatIsNot) {
  const std::vector<std::array<std::uint32_t, 4>> rows{{0, 1, 2, 3}, {3, 7, 1, 9}};
  const auto refused = rows_by_vertex(rows, 7);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("rows[1]: vertex 7 is not in [0, 7)"));
  const std::vector<std::array<std::uint32_t, 5>> five{{0, 1, 2, 2, 4}};
  const RowsByVertex once = rows_by_vertex(five, 6).value();
  EXPECT_EQ(once.begin, (std::vector<std::size_t>{0, 1, 2, 3, 3, 4, 4}));
  EXPECT_EQ(rows_by_vertex(std::span<const std::array<std::uint32_t, 4>>(), 0).value().begin,
            (std::vector<std::size_t>{0}));
}

}  // namespace
}  // namespace warmfront
