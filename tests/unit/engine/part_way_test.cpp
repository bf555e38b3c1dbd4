// SPDX-License-Identifier: Apache-2.0
// Commits of part of a motion round, and what max_step() allows is never taken through anything by that.
#include "engine/part_way.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "engine/collider.h"
#include "engine/pose.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

// On which side of the face of vertices 0 to 2 vertex 3 is.
int side(std::span<const double> positions) {
  const auto from_first = [&](std::size_t v, std::size_t axis) {
    return mpq_class(mpq_class(positions[3 * v + axis]) - mpq_class(positions[axis]));
  };
  const auto minor = [&](std::size_t i, std::size_t j) {
    return mpq_class(from_first(1, i) * from_first(2, j) - from_first(1, j) * from_first(2, i));
  };
  const mpq_class volume =
      minor(1, 2) * from_first(3, 0) + minor(2, 0) * from_first(3, 1) + minor(0, 1) * from_first(3, 2);
  return sgn(volume);
}

// Four vertices that move, far from the origin: a vertex above a face, and below it at the end; or an edge
// above another one, and below it.
struct Passing {
  SceneDescription scene{4, {}, {}};
  std::vector<double> start, end;

  Passing(ContactKind kind, std::mt19937& random, double away, bool single) {
    const bool face = kind == ContactKind::kVertexFace;
    if (face)
      scene.faces = {{0, 1, 2}};
    else
      scene.edges = {{0, 1}, {2, 3}};
    scene.bodies = {{"", 0, face ? 3U : 2U}, {"", face ? 3U : 2U, face ? 1U : 2U}};
    std::uniform_real_distribution<double> some(-0.1, 0.1);
    const double of_face[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0.5};
    const double of_edges[] = {-1, 0, 0, 1, 0, 0, 0, -1, 0.5, 0, 1, 0.5};
    const std::span<const double> corners(face ? of_face : of_edges);
    const auto coordinate = [&](double x) { return single ? static_cast<float>(away + x) : away + x; };
    for (std::size_t i = 0; i < corners.size(); ++i) {
      start.push_back(coordinate(corners[i] + some(random)));
      const bool falls = i / 3 >= scene.bodies[1].first_vertex;
      const bool is_height = i % 3 == 2;
      end.push_back(coordinate(corners[i] + some(random) + (!is_height ? 0 : falls ? -1 : 0.3)));
    }
  }
  double largest() const {
    double most = 0;
    for (const auto* positions : {&start, &end}) {
      for (const double x : *positions) most = std::max(most, std::abs(x));
    }
    return most;
  }
};

Collider collider_of(const SceneDescription& scene, std::span<const double> start, Tier tier) {
  return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()), start, {.tier = tier},
                          testing::workers())
      .value();
}

// Goes a share of as much of what is left of the way as `fraction_of` says, until that is none or all: is
// what was on one side on the other one then?
template <class FractionOf>
bool is_taken_through(Collider& collider, const Frame& frame, double share, Rounding rounding,
                      FractionOf&& fraction_of) {
  const int before = side(collider.positions());
  for (int i = 0; i < 60; ++i) {
    const double fraction = fraction_of(frame);
    if (fraction == 0 || fraction == 1) break;
    EXPECT_TRUE(collider.commit(share * fraction, rounding).ok());
    if (side(collider.positions()) != before) return true;
  }
  return side(collider.positions()) != before;
}

bool max_step_takes_through(Collider& collider, const Frame& frame, double share, Rounding rounding,
                            const QuestionOptions& options = {}) {
  return is_taken_through(collider, frame, share, rounding, [&](const Frame& to) {
    return collider.max_step(to, false, options, nullptr, rounding).value().fraction;
  });
}

constexpr ContactKind kKinds[] = {ContactKind::kVertexFace, ContactKind::kEdgeEdge};
constexpr Rounding kRoundings[] = {Rounding::kFloat32, Rounding::kFloat64};
constexpr Tier kTiers[] = {Tier::kCertified, Tier::kExact};

TEST(PartWay, NoCommitOfWhatMaxStepAllowsTakesAnythingThrough) {
  int by_trials = 0;
  for (const ContactKind kind : kKinds) {
    for (const Rounding rounding : kRoundings) {
      const bool single = rounding == Rounding::kFloat32;
      for (const Tier tier : kTiers) {
        for (const double away : {0.0, 100.0, 1e4}) {
          for (const double share : {0.5, 0.9, 1.0}) {
            std::mt19937 random(17);
            for (int trial = 0; trial < 8; ++trial) {
              const Passing passing(kind, random, away, single);
              const Frame frame(std::span<const double>(passing.end));
              Collider one = collider_of(passing.scene, passing.start, tier);
              ASSERT_FALSE(max_step_takes_through(one, frame, share, rounding))
                  << single << ' ' << away << ' ' << share << ' ' << trial;
              // Less of its distance than that: the room is what counts.
              Collider kept = collider_of(passing.scene, passing.start, tier);
              ASSERT_FALSE(max_step_takes_through(kept, frame, share, rounding, {.keep_distance = 1e-9}));
              // A trial leaves none.
              Collider other = collider_of(passing.scene, passing.start, tier);
              by_trials += is_taken_through(other, frame, share, rounding, [&](const Frame& to) {
                return other.trial(to).value().earliest_toi.value_or(1);
              });
            }
          }
        }
      }
    }
  }
  EXPECT_GT(by_trials, 100);
}

// Bodies that turn by up to a radian, along lines and along screws.
TEST(PartWay, NorDoesOneOfPoses) {
  for (const ContactKind kind : kKinds) {
    for (const Rounding rounding : kRoundings) {
      for (const bool screws : {false, true}) {
        for (const double away : {0.0, 100.0, 1e4}) {
          for (const double share : {0.5, 0.9, 1.0}) {
            std::mt19937 random(23);
            for (int trial = 0; trial < 4; ++trial) {
              Passing passing(kind, random, away, true);
              std::vector<BodyPose> poses;
              for (std::uint32_t body = 0; body < 2; ++body) {
                passing.scene.bodies[body].kind = BodyKind::kRigid;
                passing.scene.bodies[body].screw = screws;
                // About an axis along z through the pair.
                const double angle = std::uniform_real_distribution<double>(-1, 1)(random);
                const double c = std::cos(angle), s = std::sin(angle);
                Pose pose;
                pose.matrix = {c, -s, 0, away - c * away + s * away, s, c, 0, away - s * away - c * away,
                               0, 0,  1, body == 0 ? 0.3 : -1};
                poses.push_back({body, rounding == Rounding::kFloat32 ? in_float32(pose) : pose});
              }
              Collider collider = collider_of(passing.scene, passing.start, Tier::kCertified);
              Frame frame;
              frame.poses = poses;
              ASSERT_FALSE(max_step_takes_through(collider, frame, share, rounding))
                  << (kind == ContactKind::kVertexFace) << ' ' << screws << ' ' << away << ' ' << share << ' '
                  << trial;
            }
          }
        }
      }
    }
  }
}

// Nearer than a commit rounds is near at the start; who leaves that out is told of what it meets.
TEST(PartWay, WhatStartsWithinTheRoomIsCountedAndStillTested) {
  const std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1e-8};
  std::vector<double> through = start, away = start;
  for (std::vector<double>* end : {&through, &away}) {
    for (std::size_t v = 0; v < 3; ++v) (*end)[3 * v + 2] += 1;
  }
  away[11] += 2;
  SceneDescription scene{4, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}}};
  for (const Tier tier : kTiers) {
    Collider collider = collider_of(scene, start, tier);
    const auto ask = [&](const std::vector<double>& end, bool leave_out, Rounding rounding) {
      return collider
          .max_step(std::span<const double>(end), leave_out, {.tolerance = 1e-12}, nullptr, rounding)
          .value();
    };
    for (const auto& end : {through, away}) {
      const MaxStep near = ask(end, false, Rounding::kFloat32);
      EXPECT_EQ(near.fraction, 0);
      EXPECT_EQ(near.overlaps_at_start, 1U);
    }
    const MaxStep passes = ask(through, true, Rounding::kFloat32);
    EXPECT_EQ(passes.overlaps_at_start, 0U);
    EXPECT_GT(passes.fraction, 0);
    EXPECT_LE(passes.fraction, 1e-8);
    EXPECT_EQ(ask(away, true, Rounding::kFloat32).fraction, 1);
    // Doubles have room.
    EXPECT_EQ(ask(away, false, Rounding::kFloat64).fraction, 1);
    EXPECT_GT(ask(through, false, Rounding::kFloat64).fraction, 0);
  }
}

// A vertex that rests is not rounded: a far one does not count, and one that flies off stops nothing else.
TEST(PartWay, TheRoomIsThatOfEachPair) {
  std::vector<double> start{0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 1e-4, 0, 0, 1e9};
  std::vector<double> end = start;
  end[11] += 0.5;
  end[14] += 1e9;
  SceneDescription scene{5, {{0, 1, 2}}, {{"", 0, 3}, {"", 3, 1}, {"", 4, 1}}};
  Collider collider = collider_of(scene, start, Tier::kCertified);
  const MaxStep far =
      collider.max_step(std::span<const double>(end), false, {}, nullptr, Rounding::kFloat32).value();
  EXPECT_EQ(far.fraction, 1);
  EXPECT_EQ(far.overlaps_at_start, 0U);
}

}  // namespace
}  // namespace warmfront
