// SPDX-License-Identifier: Apache-2.0
// A whole scene at extreme scales and offsets: the answer is right, and memory does not depend on the scene's
// position. Scaled by a power of two, the answer has the same bits; shifted, so that rounding changes the
// scene, it is that of testing every pair.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <tuple>
#include <utility>

#include "engine/collider.h"
#include "engine/elementary/elementary_test.h"
#include "tests/support/brute_force.h"
#include "tests/support/cloth_over_ball.h"

namespace warmfront {
namespace {

using testing::ClothOverBall;
using testing::placed;

struct Step {
  std::vector<Contact> contacts;
  std::vector<ContactGeometry> geometry;
  StepCounts counts;
  std::size_t bytes = 0;
};

std::shared_ptr<const Scene> scene_of(const ClothOverBall& cloth) {
  return std::make_shared<const Scene>(std::move(Scene::create(cloth.description)).value());
}

std::vector<Step> step_through(const ClothOverBall& cloth, const ColliderOptions& options, int exponent,
                               double offset = 0) {
  auto start = placed(cloth.frames.front(), exponent, offset);
  auto collider = Collider::create(scene_of(cloth), std::span<const double>(start), options,
                                   std::make_shared<Workers>(2));
  EXPECT_TRUE(collider.ok());
  std::vector<Step> steps;
  for (std::size_t k = 1; k < cloth.frames.size(); ++k) {
    const auto next = placed(cloth.frames[k], exponent, offset);
    const auto result = collider.value().step(std::span<const double>(next));
    EXPECT_TRUE(result.ok());
    const Status sound = collider.value().self_check();
    EXPECT_TRUE(sound.ok()) << sound.error().message;
    steps.push_back({{result.value().contacts.begin(), result.value().contacts.end()},
                     {result.value().geometry.begin(), result.value().geometry.end()},
                     result.value().statistics.counts,
                     collider.value().memory_bytes()});
  }
  return steps;
}

class ExtremeScenes : public ::testing::TestWithParam<std::tuple<Tier, BoundsKind>> {
 protected:
  ColliderOptions options() const {
    return {.tier = std::get<0>(GetParam()),
            .bounds = std::get<1>(GetParam()),
            .normal_cones = false,
            .leaf_size = 8};
  }
};

TEST_P(ExtremeScenes, ScaledByPowersOfTwoTheAnswerIsTheSame) {
  const ClothOverBall cloth = testing::cloth_over_ball(32, 6);
  const std::vector<Step> plain = step_through(cloth, options(), 0);
  for (const int exponent : {-1000, -500, 500, 900}) {
    const std::vector<Step> scaled = step_through(cloth, options(), exponent);
    for (std::size_t k = 0; k < plain.size(); ++k) {
      ASSERT_GT(plain[k].contacts.size(), 100U);
      EXPECT_EQ(scaled[k].contacts, plain[k].contacts) << "2^" << exponent << ", step " << k;
      // The bounds are the same, so work and front are, too. (The spare memory in the front's chunks depends
      // on thread scheduling.)
      EXPECT_EQ(scaled[k].counts.triangle_pairs, plain[k].counts.triangle_pairs);
      EXPECT_EQ(scaled[k].counts.front_pairs, plain[k].counts.front_pairs);
      EXPECT_LE(scaled[k].counts.front_bytes, 2 * plain[k].counts.front_bytes);
      EXPECT_LE(scaled[k].bytes, 2 * plain[k].bytes);
    }
  }
}

// Products of four coordinates describe a contact.
TEST_P(ExtremeScenes, ScaledByPowersOfTwoTheFieldsAreTheSame) {
  const ClothOverBall cloth = testing::cloth_over_ball(16, 3);
  ColliderOptions options = this->options();
  options.fields = {.weights = true, .normal = true, .points = true};
  const std::vector<Step> plain = step_through(cloth, options, 0);
  for (const int exponent : {-900, -300, 300, 900}) {
    const std::vector<Step> scaled = step_through(cloth, options, exponent);
    for (std::size_t k = 0; k < plain.size(); ++k) {
      ASSERT_GT(plain[k].geometry.size(), 20U);
      ASSERT_EQ(scaled[k].geometry.size(), plain[k].geometry.size());
      for (std::size_t i = 0; i < plain[k].geometry.size(); ++i) {
        const ContactGeometry& right = plain[k].geometry[i];
        const ContactGeometry& there = scaled[k].geometry[i];
        ASSERT_EQ(there.weights, right.weights) << "2^" << exponent << ", contact " << i;
        ASSERT_EQ(there.normal, right.normal) << "2^" << exponent << ", contact " << i;
        for (std::size_t axis = 0; axis < 6; ++axis)
          ASSERT_EQ(there.points[axis], std::ldexp(right.points[axis], exponent)) << "2^" << exponent;
      }
    }
  }
}

TEST_P(ExtremeScenes, ShiftedTheAnswerIsThatOfEveryPair) {
  const ClothOverBall cloth = testing::cloth_over_ball(12, 4);
  const auto scene = scene_of(cloth);
  const std::vector<Step> plain = step_through(cloth, options(), 0);
  for (const int exponent : {10, 20, 30, 48}) {
    const double offset = std::ldexp(1.0, exponent);
    const std::vector<Step> shifted = step_through(cloth, options(), 0, offset);
    for (std::size_t k = 0; k < plain.size(); ++k) {
      const auto vertices =
          testing::motion_between(placed(cloth.frames[k], 0, offset), placed(cloth.frames[k + 1], 0, offset));
      std::vector<Contact> expected;
      ElementaryCounts counts;
      testing::for_all_feature_pairs(*scene, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
        const Verdict verdict = elementary_test(testing::features_of(*scene, vertices, kind, a, b),
                                                {.tier = options().tier}, counts);
        if (verdict.contact) expected.push_back({kind, verdict.status, a, b, verdict.toi});
      });
      ASSERT_GT(expected.size(), 50U);
      EXPECT_EQ(shifted[k].contacts, expected) << "offset 2^" << exponent << ", step " << k;
      // Positions in units of 2^-4 at the farthest: flat triangles in many, but no more than a few times the
      // pairs.
      EXPECT_LE(shifted[k].counts.triangle_pairs, 4 * plain[k].counts.triangle_pairs + 1000);
      EXPECT_LE(shifted[k].counts.front_bytes, 2 * plain[k].counts.front_bytes + 10'000);
      EXPECT_LE(shifted[k].bytes, 2 * plain[k].bytes);
    }
  }
}

// The ball as a rigid body, or as many small ones, that poses turn and take through the cloth: a turn by 3/5
// and 4/5, whose products a scale by a power of two leaves as they are.
class PosedBall {
 public:
  PosedBall(bool pieces, int exponent) : cloth_(testing::cloth_over_ball(12, 5)), exponent_(exponent) {
    const std::uint32_t cloth_vertices = 13 * 13;
    const std::uint32_t ball_vertices = cloth_.description.vertex_count - cloth_vertices;
    cloth_.description.bodies = {{"cloth", 0, cloth_vertices, BodyKind::kDeformable}};
    if (!pieces) {
      cloth_.description.bodies.push_back({"ball", cloth_vertices, ball_vertices, BodyKind::kRigid});
      start_ = cloth_.frames.front();
    } else {
      take_ball_apart(cloth_vertices);
    }
  }

  std::vector<Step> run(const ColliderOptions& options) const {
    const auto start = placed(start_, exponent_);
    auto collider = Collider::create(scene_of(cloth_), std::span<const double>(start), options,
                                     std::make_shared<Workers>(2));
    EXPECT_TRUE(collider.ok());
    std::vector<Step> steps;
    Pose pose;
    for (std::size_t k = 1; k < cloth_.frames.size(); ++k) {
      Pose next;
      for (std::size_t row = 0; row < 2; ++row) {
        for (std::size_t column = 0; column < 3; ++column)
          next.matrix[4 * row + column] = (row == 0 ? 0.8 : 0.6) * pose.matrix[column] +
                                          (row == 0 ? -0.6 : 0.8) * pose.matrix[4 + column];
      }
      next.matrix[11] = std::ldexp(0.0625 * static_cast<double>(k), exponent_);
      pose = next;
      std::vector<BodyPose> poses;
      for (std::uint32_t b = 1; b < cloth_.description.bodies.size(); ++b) poses.push_back({b, pose});
      auto sheet = placed(cloth_.frames[k], exponent_);
      sheet.resize(std::size_t{3} * cloth_.description.bodies[0].vertex_count);
      const BodyPositions moved{0, std::span<const double>(sheet)};
      Frame frame;
      frame.poses = poses;
      frame.bodies = {&moved, 1};
      const auto result = collider.value().step(frame);
      EXPECT_TRUE(result.ok());
      if (!result.ok()) return steps;
      const Status sound = collider.value().self_check();
      EXPECT_TRUE(sound.ok()) << sound.error().message;
      steps.push_back({{result.value().contacts.begin(), result.value().contacts.end()},
                       {},
                       result.value().statistics.counts,
                       collider.value().memory_bytes()});
    }
    return steps;
  }

 private:
  // Every face of the ball becomes a body with vertices of its own.
  void take_ball_apart(std::uint32_t cloth_vertices) {
    SceneDescription& description = cloth_.description;
    const std::vector<double>& all = cloth_.frames.front();
    start_.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(3 * cloth_vertices));
    std::uint32_t vertices = cloth_vertices;
    for (auto& face : description.faces) {
      if (face[0] < static_cast<std::int32_t>(cloth_vertices)) continue;
      description.bodies.push_back({"", vertices, 3, BodyKind::kRigid});
      for (std::int32_t& v : face) {
        const auto first = all.begin() + static_cast<std::ptrdiff_t>(3) * v;
        start_.insert(start_.end(), first, first + 3);
        v = static_cast<std::int32_t>(vertices++);
      }
    }
    description.vertex_count = vertices;
  }

  ClothOverBall cloth_;
  std::vector<double> start_;
  int exponent_;
};

// Parts that move by poses are represented by a moving ball until something is near.
TEST_P(ExtremeScenes, PosedBodiesScaledByPowersOfTwoAnswerTheSame) {
  ColliderOptions options = this->options();
  for (const auto& [pieces, planes] : {std::pair{false, true}, {true, false}, {true, true}}) {
    options.separate_parts = planes;
    const std::vector<Step> plain = PosedBall(pieces, 0).run(options);
    ASSERT_EQ(plain.size(), 4U);
    for (const int exponent : {-900, -560, -300, 300, 560, 900}) {
      const std::vector<Step> scaled = PosedBall(pieces, exponent).run(options);
      ASSERT_EQ(scaled.size(), plain.size());
      for (std::size_t k = 0; k < plain.size(); ++k) {
        ASSERT_GT(plain[k].contacts.size(), 20U) << "step " << k;
        EXPECT_EQ(scaled[k].contacts, plain[k].contacts) << "2^" << exponent << ", step " << k;
        // As tight as at any other scale: an unbounded ball would also be correct.
        EXPECT_EQ(scaled[k].counts.near_parts, plain[k].counts.near_parts) << "2^" << exponent;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Ways, ExtremeScenes,
                         ::testing::Combine(::testing::Values(Tier::kCertified, Tier::kExact),
                                            ::testing::Values(BoundsKind::kKDop18, BoundsKind::kAabb)),
                         [](const auto& info) {
                           return std::string(to_string(std::get<0>(info.param))) + "_" +
                                  std::string(to_string(std::get<1>(info.param)));
                         });

}  // namespace
}  // namespace warmfront
