// SPDX-License-Identifier: Apache-2.0
// Trials that go part of the way of the one before them: they are recognised, answer as a fresh collider
// does, and leave what the questions after them need.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "engine/collider.h"
#include "tests/unit/engine/swinging_sheets.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;
using testing::kSheetVertices;
using testing::swinging_sheets;
using testing::swung;

std::vector<double> part(const std::vector<double>& x, const std::vector<double>& y, double s,
                         bool single = true) {
  std::vector<double> z(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    z[i] = x[i] + s * (y[i] - x[i]);
    if (single) z[i] = static_cast<float>(z[i]);
  }
  return z;
}

class LineSearch : public ::testing::Test {
 protected:
  void make(int count, bool bodies, ColliderOptions options, double offset = 0) {
    count_ = count;
    offset_ = offset;
    options_ = options;
    scene_ = std::make_shared<const Scene>(Scene::create(swinging_sheets(count, bodies)).value());
    workers_ = std::make_shared<Workers>(2);
    collider_.emplace(Collider::create(scene_, Doubles(swung(count, 0, offset)), options, workers_).value());
  }

  /// What a fresh collider answers from where this one stands.
  void expect_as_fresh(const std::vector<double>& to, const QuestionOptions& question,
                       const StepResult& answer) {
    const std::vector<Contact> contacts(answer.contacts.begin(), answer.contacts.end());
    Collider fresh = Collider::create(scene_, Doubles(collider_->positions()), options_, workers_).value();
    const StepResult expected = fresh.step(Doubles(to), nullptr, {}, question).value();
    ASSERT_EQ(answer.vf, expected.vf);
    ASSERT_EQ(answer.ee, expected.ee);
    ASSERT_EQ(answer.earliest_toi, expected.earliest_toi);
    ASSERT_TRUE(std::ranges::equal(contacts, expected.contacts));
    contacts_ += contacts.size();
  }
  /// Asks, compares, and returns whether it was recognised as part of the way.
  bool trial(const std::vector<double>& to, const QuestionOptions& question = {}) {
    const StepResult answer = collider_->trial(Doubles(to), question).value();
    expect_as_fresh(to, question, answer);
    EXPECT_TRUE(collider_->self_check().ok());
    return answer.statistics.part_of_trial;
  }
  std::vector<double> here() const { return collider_->positions(); }
  std::vector<double> later(double time) const { return swung(count_, time, offset_); }

  int count_ = 0;
  double offset_ = 0;
  ColliderOptions options_;
  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<Workers> workers_;
  std::optional<Collider> collider_;
  std::size_t contacts_ = 0;
};

// What bounds are widened by is more than budgets hold: none of them counts any more.
TEST_F(LineSearch, AfterSeparationsLargerThanTheSceneAllIsFoundAgain) {
  for (const double separation : {1.0, 1e3, 1e7, 1e12}) {
    make(2, false, {.find_bodies = false});
    contacts_ = 0;
    trial(later(1));
    const std::size_t before = std::exchange(contacts_, 0);
    trial(later(1), {.min_separation = separation, .report = Report::kCount});
    trial(later(1));
    EXPECT_EQ(contacts_, before) << separation;
    const MaxStep near = collider_->max_step(Doubles(later(1)), true, {.keep_distance = 1 - 1e-6}).value();
    EXPECT_LT(near.fraction, 1e-2) << separation;
    trial(later(1));
    EXPECT_EQ(contacts_, 2 * before) << separation;
    EXPECT_GT(before, 100U);
  }
}

TEST_F(LineSearch, ShorterTrialsAreRecognisedAndAnswerAsAFreshCollider) {
  for (const FrontMode front : {FrontMode::kWarm, FrontMode::kPaper, FrontMode::kNone}) {
    for (const BoundsKind bounds : {BoundsKind::kKDop18, BoundsKind::kAabb}) {
      for (const Tier tier : {Tier::kCertified, Tier::kExact, Tier::kFast}) {
        ColliderOptions options;
        options.front = front;
        options.bounds = bounds;
        options.tier = tier;
        make(2, tier != Tier::kFast, options);
        std::mt19937 random(7);
        for (int k = 1; k <= 6; ++k) {
          const std::vector<double> x = here();
          const std::vector<double> y = later(0.3 * k);
          EXPECT_FALSE(trial(y));
          double s = 1;
          for (int i = 0; i < 3; ++i) {
            s *= std::uniform_real_distribution(0.3, 0.9)(random);
            EXPECT_TRUE(trial(part(x, y, s))) << s;
          }
          ASSERT_TRUE(collider_->commit(k % 3 == 0 ? 1 : k % 3 == 1 ? 0.7 : 0.0).ok());
          if (k % 2 == 0) {
            const std::vector<double> to = later(0.3 * k + 0.1);
            const std::vector<double> from = here();
            const StepResult stepped = collider_->step(Doubles(to)).value();
            const std::uint64_t vf = stepped.vf;
            Collider fresh = Collider::create(scene_, Doubles(from), options_, workers_).value();
            EXPECT_EQ(vf, fresh.step(Doubles(to)).value().vf);
            EXPECT_TRUE(collider_->self_check().ok());
          }
        }
      }
    }
  }
  EXPECT_GT(contacts_, 10'000u);
}

// Of what rests an answer is kept, and not which pairs met: points have bounds that overlap those of a face
// of a static body, and are no contacts, but candidates.
TEST_F(LineSearch, AfterAQuestionThatKeptAnswersAnotherOneAsksAboutAllThatRests) {
  constexpr std::uint32_t kPoints = 200, kMoving = 200;
  SceneDescription scene;
  std::vector<double> start;
  const auto vertex = [&](double x, double y, double z) { start.insert(start.end(), {x, y, z}); };
  for (std::uint32_t i = 0; i < kPoints; ++i) vertex(0.3 + 1e-4 * i, 0.3, 0.7);
  for (std::uint32_t i = 0; i < kMoving; ++i) {
    const auto v = static_cast<std::int32_t>(start.size() / 3);
    for (int k = 0; k < 3; ++k) vertex(100 + 2 * i + (k == 1), k == 2, 0);
    scene.faces.push_back({v, v + 1, v + 2});
  }
  const auto first = static_cast<std::uint32_t>(start.size() / 3);
  vertex(0, 0, 0);
  vertex(1, 0, 1);
  vertex(0, 1, 1);
  const auto f = static_cast<std::int32_t>(first);
  scene.faces.push_back({f, f + 1, f + 2});
  scene.vertex_count = first + 3;
  scene.bodies.push_back({"", 0, first, BodyKind::kDeformable});
  scene.bodies.push_back({"", first, 3, BodyKind::kStatic});
  scene_ = std::make_shared<const Scene>(Scene::create(scene).value());
  workers_ = std::make_shared<Workers>(1);
  options_ = {.report = Report::kCount};
  collider_.emplace(Collider::create(scene_, Doubles(start), options_, workers_).value());
  const auto moved = [&](double by) {
    std::vector<double> positions = start;
    for (std::size_t v = kPoints; v < first; ++v) positions[3 * v + 2] += by;
    return positions;
  };
  for (int i = 1; i <= 4; ++i) ASSERT_TRUE(collider_->step(Doubles(moved(0.125 * i))).ok());
  EXPECT_FALSE(trial(moved(2)));
  trial(moved(1), {.report = Report::kCandidates});
  EXPECT_EQ(contacts_, kPoints);
}

TEST_F(LineSearch, ATrialBesideTheLineIsNoPartOfIt) {
  make(2, false, {});
  const std::vector<double> x = here();
  const std::vector<double> y = later(0.5);
  EXPECT_FALSE(trial(y));
  std::vector<double> bent = part(x, y, 0.5);
  bent[100] += 1e-4;
  EXPECT_FALSE(trial(bent));
  EXPECT_TRUE(trial(part(x, bent, 0.5)));  // which is the longest trial now
  EXPECT_FALSE(trial(y));                  // longer than that
  EXPECT_TRUE(trial(part(x, y, 0.25)));
  EXPECT_FALSE(trial(later(0.6)));
  // From elsewhere it is another way.
  ASSERT_TRUE(collider_->commit(0.5).ok());
  EXPECT_FALSE(trial(part(x, y, 0.25)));
}

TEST_F(LineSearch, OneVertexThatRestedAndMovesIsSeen) {
  make(2, false, {});
  const std::vector<double> x = here();
  std::vector<double> y = later(0.5);
  for (int axis = 0; axis < 3; ++axis) y[300 + axis] = x[300 + axis];
  EXPECT_FALSE(trial(y));
  std::vector<double> z = part(x, y, 0.5, false);
  z[300] = x[300] + 1e-12;
  EXPECT_FALSE(trial(z));
}

TEST_F(LineSearch, TheWholeWayAndNoneOfItAreParts) {
  make(2, false, {});
  const std::vector<double> x = here();
  const std::vector<double> y = later(0.5);
  EXPECT_FALSE(trial(y));
  EXPECT_TRUE(trial(y));
  EXPECT_TRUE(trial(x));
  EXPECT_TRUE(trial(part(x, y, 1e-3)));
  ASSERT_TRUE(collider_->commit(1).ok());
  EXPECT_FALSE(trial(later(1)));
}

TEST_F(LineSearch, OtherOptionsOnTheSameLine) {
  ColliderOptions options;
  options.min_separation = 0.02;
  make(3, true, options);
  for (int k = 1; k <= 5; ++k) {
    const std::vector<double> x = here();
    const std::vector<double> y = later(0.3 * k);
    // What max_step() looked at ends at the earliest contact.
    const MaxStep far = collider_->max_step(Doubles(y)).value();
    if (far.fraction < 1) {
      EXPECT_FALSE(trial(part(x, y, 1)));
    }
    trial(part(x, y, 0.9), {.tolerance = 1e-3});
    trial(part(x, y, 0.8), {.report = Report::kCount});
    trial(part(x, y, 0.7), {.report = Report::kEarliest});
    trial(part(x, y, 0.6), {.min_separation = 0.01});
    trial(part(x, y, 0.5), {.min_separation = 0.05});  // wider than any bounds so far
    EXPECT_TRUE(trial(part(x, y, 0.4), {.min_separation = 0.05}));
    trial(part(x, y, 0.3), {.tier = Tier::kExact, .min_separation = 0});
    trial(part(x, y, 0.2), {.tier = Tier::kFast, .min_separation = 0});
    ASSERT_TRUE(collider_->commit(1).ok());
    ASSERT_TRUE(collider_->step(Doubles(y)).ok());
  }
}

// The scene's middle is its origin when it is made: what is far from 0 rounds to float32 more coarsely than
// the room that bounds leave, and is then asked about as any other trial.
TEST_F(LineSearch, FarFromTheOrigin) {
  make(2, false, {}, 1e6);
  const std::vector<double> x = here();
  const std::vector<double> y = later(0.5);
  EXPECT_FALSE(trial(y));
  EXPECT_FALSE(trial(part(x, y, 0.5)));
  EXPECT_FALSE(trial(y));
  EXPECT_TRUE(trial(part(x, y, 0.5, false)));
}

// Part of the way of what turns is no rotation of what is at its ends.
TEST_F(LineSearch, BodiesFoundRigid) {
  make(4, true, {});
  const auto turned = [&](double angle) {
    std::vector<double> positions = swung(4, 0);
    for (std::uint32_t b = 0; b < 4; ++b) {
      const double cosine = std::cos(angle * (b + 1)), sine = std::sin(angle * (b + 1));
      for (std::uint32_t v = b * kSheetVertices; v < (b + 1) * kSheetVertices; ++v) {
        double* p = &positions[3 * v];
        const double px = p[0] - 6, py = p[1] - 6;
        p[0] = cosine * px - sine * py;
        p[1] = sine * px + cosine * py;
        p[2] += 3.0 * b - angle * b;
      }
    }
    return positions;
  };
  ASSERT_TRUE(collider_->step(Doubles(turned(0))).ok());
  std::uint64_t rigid = 0;
  int parts = 0;
  for (int k = 1; k <= 40; ++k) {
    const std::vector<double> x = here();
    const std::vector<double> y = turned(0.02 * k);
    const StepResult whole = collider_->trial(Doubles(y)).value();
    rigid = whole.statistics.counts.parts_rigid;
    expect_as_fresh(y, {}, whole);
    parts += trial(part(x, y, 0.5));
    parts += trial(part(x, y, 0.25));
    ASSERT_TRUE(collider_->trial(Doubles(y)).ok());
    ASSERT_TRUE(collider_->commit(1, Rounding::kFloat64).ok());
  }
  EXPECT_EQ(rigid, 4u);
  EXPECT_GT(parts, 70);
}

// A trial that is taken as a whole leaves what a step leaves: the next one looks at no more.
TEST_F(LineSearch, TrialsThatAreTakenTestWhatStepsTest) {
  for (const bool bodies : {false, true}) {
    make(3, bodies, {});
    const auto scene = std::make_shared<const Scene>(Scene::create(swinging_sheets(3, bodies)).value());
    const std::vector<double> x = here();
    Collider stepper = Collider::create(scene, Doubles(x), {}, std::make_shared<Workers>(1)).value();
    std::uint64_t skipped = 0;
    for (int k = 1; k <= 24; ++k) {
      const std::vector<double> y = later(0.01 * k);
      const StepCounts stepped = stepper.step(Doubles(y)).value().statistics.counts;
      const StepCounts tried = collider_->trial(Doubles(y)).value().statistics.counts;
      EXPECT_TRUE(collider_->self_check().ok());
      ASSERT_TRUE(collider_->commit(1).ok());
      EXPECT_EQ(tried.primitive_tests, stepped.primitive_tests) << k;
      EXPECT_EQ(tried.front_skipped, stepped.front_skipped) << k;
      EXPECT_EQ(tried.front_pairs, stepped.front_pairs) << k;
      skipped += stepped.front_skipped;
    }
    EXPECT_GT(skipped, 0u);
  }
}

TEST_F(LineSearch, WhatRestsIsKeptInShorterTrials) {
  make(3, true, {.min_separation = 0.3});
  std::vector<double> x = here();
  for (int k = 1; k <= 4; ++k) {
    std::vector<double> y = later(0.3 * k);
    for (std::size_t i = 0; i < std::size_t{6} * kSheetVertices; ++i)
      y[i] = x[i];  // two of three bodies rest, in contact
    EXPECT_FALSE(trial(y));
    y.back() += 0.125;
    EXPECT_FALSE(trial(y));  // which finds what rests known
    EXPECT_TRUE(trial(part(x, y, 0.5, false)));
    EXPECT_TRUE(trial(part(x, y, 0.25, false)));
    EXPECT_FALSE(trial(part(x, y, 0.2, false), {.tolerance = 1e-3}));  // by other options it is not
    ASSERT_TRUE(collider_->commit(1).ok());
    x = here();
  }
}

}  // namespace
}  // namespace warmfront
