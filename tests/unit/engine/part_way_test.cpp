// SPDX-License-Identifier: Apache-2.0
// Commits of part of a motion round, and what max_step() allows is never taken through anything by that.
#include "engine/part_way.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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
              // With overlaps left out: nothing overlaps at first.
              Collider left_out = collider_of(passing.scene, passing.start, tier);
              ASSERT_FALSE(is_taken_through(left_out, frame, share, rounding, [&](const Frame& to) {
                return left_out.max_step(to, true, {}, nullptr, rounding).value().fraction;
              }));
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

// A share of a subnormal number may be 0, and its rounding is none.
TEST(PartWay, NorWhereNumbersUnderflow) {
  for (const Rounding rounding : kRoundings) {
    const bool single = rounding == Rounding::kFloat32;
    for (const double share : {0.5, 0.9, 1.0}) {
      std::mt19937 random(19);
      for (int trial = 0; trial < 16; ++trial) {
        Passing passing(trial % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge, random, 0,
                        single);
        for (auto* positions : {&passing.start, &passing.end}) {
          for (double& x : *positions) {
            x *= single ? 0x1p-140 : 0x1p-1065;
            if (single) x = static_cast<float>(x);
          }
        }
        Collider collider = collider_of(passing.scene, passing.start, Tier::kCertified);
        const Frame frame(std::span<const double>(passing.end));
        ASSERT_FALSE(max_step_takes_through(collider, frame, share, rounding)) << share << ' ' << trial;
      }
    }
  }
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

// On which side of a half-space, where its pose has it, a vertex is: 1 outside.
int outside(const std::vector<double>& x, const HalfSpace& at_rest, Pose pose) {
  const std::array<double, 3> point = pose.place(at_rest.point.data());
  for (const std::size_t shift : {3, 7, 11}) pose.matrix[shift] = 0;
  const std::array<double, 3> normal = pose.place(at_rest.normal.data());
  mpq_class distance;
  for (std::size_t axis = 0; axis < 3; ++axis)
    distance += mpq_class(normal[axis]) * (mpq_class(x[axis]) - mpq_class(point[axis]));
  return sgn(distance);
}

TEST(PartWay, NorIntoAHalfSpace) {
  for (const Rounding rounding : kRoundings) {
    for (const bool posed : {false, true}) {
      for (const double away : {0.0, 100.0, 1e4}) {
        for (const double share : {0.5, 0.9, 1.0}) {
          std::mt19937 random(31);
          for (int trial = 0; trial < 8; ++trial) {
            std::uniform_real_distribution<double> some(-0.1, 0.1);
            const auto at = [&](double height) {
              return std::vector<double>{static_cast<float>(away + some(random)),
                                         static_cast<float>(away + some(random)),
                                         static_cast<float>(away + height + some(random))};
            };
            const std::vector<double> start = at(1), end = at(-1);
            const HalfSpace ground{{away, away, away}, {1, 2, 3}};
            SceneDescription scene{1, {}, {{"", 0, 1}, {"", 1, 0}}};
            scene.bodies[1].kind = posed ? BodyKind::kRigid : BodyKind::kStatic;
            scene.bodies[1].half_space = ground;
            Collider collider = collider_of(scene, start, trial % 2 == 0 ? Tier::kExact : Tier::kCertified);
            BodyPose pose{1, {}};
            const double c = std::cos(some(random)), s = std::sqrt(1 - c * c);
            pose.pose.matrix = {c, -s, 0,  away - c * away + s * away, s, c, 0, away - s * away - c * away, 0,
                                0, 1,  0.2};
            if (rounding == Rounding::kFloat32) pose.pose = in_float32(pose.pose);
            const BodyPositions moved{0, std::span<const double>(end)};
            Frame frame;
            frame.bodies = {&moved, 1};
            if (posed) frame.poses = {&pose, 1};
            for (int i = 0; i < 60; ++i) {
              const double fraction = collider.max_step(frame, false, {}, nullptr, rounding).value().fraction;
              if (fraction == 0 || fraction == 1) break;
              ASSERT_TRUE(collider.commit(share * fraction, rounding).ok());
              const Pose now = posed ? collider.poses().at(0).pose : Pose{};
              ASSERT_EQ(outside(collider.positions(), ground, now), 1)
                  << posed << ' ' << away << ' ' << share << ' ' << trial << ' ' << i;
            }
          }
        }
      }
    }
  }
}

// What was stopped is not near at the start of what comes next: it may go back all of the way.
TEST(PartWay, WhatWasStoppedMayGoOn) {
  for (const ContactKind kind : kKinds) {
    for (const Rounding rounding : kRoundings) {
      for (const Tier tier : kTiers) {
        std::mt19937 random(41);
        for (int trial = 0; trial < 20; ++trial) {
          const Passing passing(kind, random, trial % 2 == 0 ? 0 : 100, rounding == Rounding::kFloat32);
          Collider collider = collider_of(passing.scene, passing.start, tier);
          const auto far = [&](const std::vector<double>& to) {
            return collider
                .max_step(std::span<const double>(to), false, {.tolerance = 1e-12}, nullptr, rounding)
                .value();
          };
          ASSERT_TRUE(collider.commit(far(passing.end).fraction, rounding).ok());
          const MaxStep back = far(passing.start);
          ASSERT_EQ(back.fraction, 1) << trial;
          ASSERT_EQ(back.overlaps_at_start, 0U);
        }
      }
    }
  }
}

}  // namespace
}  // namespace warmfront
