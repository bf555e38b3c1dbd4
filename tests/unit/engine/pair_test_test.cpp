// SPDX-License-Identifier: Apache-2.0
// test_pair(): the answer of a collider whose scene is the pair, in any floating-point environment; and what
// it refuses.
#include "engine/pair_test.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cfenv>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "engine/elementary/query.h"
#include "tests/support/max_step_oracle.h"
#include "tests/support/scenes.h"
#include "tests/support/torture.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using ::testing::HasSubstr;
using Doubles = std::span<const double>;

MovingPair pair_of(const testing::FeatureCase& query) {
  MovingPair pair{query.kind, {}, {}};
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pair.start[v][axis] = query.vertices[v].t0[axis];
      pair.end[v][axis] = query.vertices[v].t1[axis];
    }
  }
  return pair;
}

/// A scene of the pair's two features alone.
Collider collider_of(const MovingPair& pair, const ColliderOptions& options) {
  SceneDescription scene;
  scene.vertex_count = 4;
  if (pair.kind == ContactKind::kVertexFace) {
    scene.faces = {{1, 2, 3}};
  } else {
    scene.edges = {{0, 1}, {2, 3}};
  }
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                          Doubles(pair.start[0].data(), 12), options, testing::workers())
      .value();
}

// As max_step(), which leaves room for what a commit rounds.
std::optional<PairContact> with_room(const MovingPair& pair, PairOptions options) {
  std::array<VertexMotion, 4> vertices;
  FeatureVertices features{pair.kind, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    std::ranges::copy(pair.start[k], vertices[k].t0.begin());
    std::ranges::copy(pair.end[k], vertices[k].t1.begin());
    features.vertex[k] = &vertices[k];
  }
  const double asked = options.min_separation;
  const auto test = [&](double separation) {
    options.min_separation = separation;
    const std::optional<PairContact> contact = test_pair(pair, options).value();
    return contact ? Verdict{true, contact->status, contact->toi} : Verdict{};
  };
  const double rounding = testing::room_of(features, Rounding::kFloat64);
  const Verdict verdict =
      testing::with_room(asked, false, testing::lines_in_room(features, rounding, true, asked, test));
  return verdict.contact ? std::optional(PairContact{verdict.status, verdict.toi}) : std::nullopt;
}

std::optional<PairContact> by_collider(const MovingPair& pair, const PairOptions& options) {
  Collider collider = collider_of(
      pair, {.tier = options.tier, .tolerance = options.tolerance, .min_separation = options.min_separation});
  const Doubles end(pair.end[0].data(), 12);
  std::optional<PairContact> first;
  if (options.keep_distance > 0) {
    const MaxStep far = collider.max_step(end, false, {.keep_distance = options.keep_distance}).value();
    if (far.first) first = PairContact{far.first->status, far.first->toi};
  } else {
    const StepResult answer = collider.step(end).value();
    if (!answer.contacts.empty()) first = PairContact{answer.contacts[0].status, answer.contacts[0].toi};
  }
  return first;
}

TEST(PairTest, AnswersAsACollider) {
  std::mt19937_64 random(11);
  int contacts = 0;
  for (const testing::TortureFamily& family : testing::torture_families()) {
    for (const ContactKind kind : {ContactKind::kVertexFace, ContactKind::kEdgeEdge}) {
      for (int k = 0; k < 4; ++k) {
        const testing::FeatureCase query = family.make(random, kind);
        const MovingPair pair = pair_of(query);
        const double size = std::min(1e300, std::abs(pair.start[0][0] - pair.start[3][0]));
        for (const PairOptions& options : {PairOptions{},
                                           {.tier = Tier::kExact},
                                           {.tier = Tier::kFast},
                                           {.tolerance = 1e-3, .min_separation = 0.1 * size},
                                           {.tier = Tier::kExact, .min_separation = 0.1 * size},
                                           {.keep_distance = 0.2}}) {
          const auto answer = test_pair(pair, options);
          ASSERT_TRUE(answer.ok()) << answer.error().message;
          EXPECT_EQ(options.keep_distance > 0 ? with_room(pair, options) : answer.value(),
                    by_collider(pair, options))
              << family.name << ", tier " << to_string(options.tier) << ", separation "
              << options.min_separation << ", keep_distance " << options.keep_distance << "\n"
              << testing::to_text(query);
          contacts += answer.value().has_value();
        }
      }
    }
  }
  EXPECT_GT(contacts, 200);
}

MovingPair falling() {
  return {ContactKind::kVertexFace,
          {{{0.25, 0.25, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
          {{{0.25, 0.25, -1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}};
}

TEST(PairTest, TellsNothingLaterThanAsked) {
  for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact}) {
    EXPECT_TRUE(test_pair(falling(), {.tier = tier, .latest = 0.5}).value());
    EXPECT_FALSE(test_pair(falling(), {.tier = tier, .latest = 0.49}).value());
  }
  EXPECT_EQ(test_pair(falling(), {.tier = Tier::kExact}).value()->toi, 0.5);
  EXPECT_NEAR(test_pair(falling(), {.keep_distance = 0.5}).value()->toi, 0.25, 0.25 * 0x1p-7);
  EXPECT_FALSE(test_pair(falling(), {.keep_distance = 0.5, .latest = 0.2}).value());
}

TEST(PairTest, APointIsAVertexTwice) {
  const MovingPair point_and_edge{ContactKind::kEdgeEdge,
                                  {{{0, 0, 1}, {0, 0, 1}, {-1, 0, 0}, {1, 0, 0}}},
                                  {{{0, 0, -1}, {0, 0, -1}, {-1, 0, 0}, {1, 0, 0}}}};
  EXPECT_EQ(test_pair(point_and_edge, {.tier = Tier::kExact}).value()->toi, 0.5);
  EXPECT_EQ(test_pair(point_and_edge, {.tier = Tier::kExact, .min_separation = 0.5}).value()->toi, 0.25);
}

TEST(PairTest, IsTheSameInAnyFloatingPointEnvironment) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 50; ++k) {
    for (const testing::TortureFamily& family : testing::torture_families()) {
      const MovingPair pair = pair_of(family.make(random, ContactKind::kEdgeEdge));
      const auto usual = test_pair(pair).value();
      for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
        std::fesetround(mode);
        const auto answer = test_pair(pair).value();
        EXPECT_EQ(std::fegetround(), mode);
        std::fesetround(FE_TONEAREST);
        EXPECT_EQ(answer, usual) << family.name;
      }
    }
  }
}

// Programs that hunt for their own mistakes let what is inexact or too small end them.
TEST(PairTest, DoesNotTrapWhereItsCallerWould) {
  std::mt19937_64 random(6);
  const MovingPair pair = pair_of(testing::torture_families().front().make(random, ContactKind::kEdgeEdge));
  const auto usual = test_pair(pair).value();
  const int trapped = FE_INEXACT | FE_UNDERFLOW | FE_OVERFLOW;
  if (feenableexcept(trapped) == -1) GTEST_SKIP() << "this machine cannot trap";
  const auto answer = test_pair(pair);
  const int still = fegetexcept();
  fedisableexcept(trapped);
  EXPECT_EQ(still, trapped);
  EXPECT_EQ(answer.value(), usual);
}

std::string refusal(const MovingPair& pair, const PairOptions& options = {}) {
  const auto answer = test_pair(pair, options);
  if (answer.ok()) return "accepted";
  EXPECT_EQ(answer.error().code, ErrorCode::kInvalidArgument);
  return answer.error().message;
}

TEST(PairTest, RefusesWhatItCannotDecide) {
  MovingPair pair = falling();
  pair.end[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(pair), "end: vertex 2, y is not finite");
  pair = falling();
  pair.start[3][2] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal(pair), "start: vertex 3, z is not finite");
  pair = falling();
  pair.kind = ContactKind::kEdgeFace;
  EXPECT_THAT(refusal(pair), HasSubstr("kind"));
  EXPECT_THAT(refusal(falling(), {.tolerance = 0}), HasSubstr("tolerance"));
  EXPECT_THAT(refusal(falling(), {.min_separation = -1}), HasSubstr("min_separation"));
  EXPECT_THAT(refusal(falling(), {.keep_distance = 1}), HasSubstr("keep_distance"));
  EXPECT_THAT(refusal(falling(), {.tier = Tier::kFast, .keep_distance = 0.5}), HasSubstr("keep_distance"));
  EXPECT_THAT(refusal(falling(), {.latest = 2}), HasSubstr("latest"));
  EXPECT_THAT(refusal(falling(), {.tier = static_cast<Tier>(7)}), HasSubstr("tier"));
}

}  // namespace
}  // namespace warmfront
