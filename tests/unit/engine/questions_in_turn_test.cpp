// SPDX-License-Identifier: Apache-2.0
// Every question after every other, of the same motion and of half of it, in a scene of all kinds of
// geometry: what one leaves is all that the next one needs, and each answers as a fresh collider does.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using Doubles = std::span<const double>;

/// What may be told of an answer but for its cost.
struct Told {
  std::string error;
  KindCounts counts = {};
  std::uint64_t possible = 0;
  std::optional<double> earliest = std::nullopt;
  std::vector<Contact> contacts = {};
  std::vector<double> distances = {};

  friend bool operator==(const Told&, const Told&) = default;
};

std::ostream& operator<<(std::ostream& out, const Told& told) {
  return out << told.error << " vf " << told.counts.vf << ", ee " << told.counts.ee << ", ve "
             << told.counts.ve << ", vv " << told.counts.vv << ", vh " << told.counts.vh << ", ef "
             << told.counts.ef << ", " << told.contacts.size() << " listed";
}

Told ask(Collider& collider, const std::vector<double>& to, const Question& question) {
  const Result<StepResult> answer =
      collider.ask(question.of_state() ? Frame() : Frame(Doubles(to)), question);
  if (!answer) return {.error = answer.error().message};
  const StepResult& result = answer.value();
  return {{},
          result,
          result.possible,
          result.earliest_toi,
          {result.contacts.begin(), result.contacts.end()},
          {result.vertex_distances.begin(), result.vertex_distances.end()}};
}

/// Two rods and three points, thick or not; a wavy sheet; a rigid tetrahedron; a ground and a still triangle.
/// All near each other.
struct Mixture {
  Mixture(std::uint32_t seed, bool thick) : random(seed) {
    const auto body = [&](std::uint32_t count, BodyKind kind, double size) {
      scene.bodies.push_back({"", scene.vertex_count, count, kind});
      scene.vertex_count += count;
      const double middle[3] = {uniform(0.3), uniform(0.3), uniform(0.3)};
      for (std::uint32_t i = 0; i < 3 * count; ++i) x.push_back(middle[i % 3] + uniform(size));
    };
    body(6, BodyKind::kDeformable, 0.5);
    scene.edges = {{0, 1}, {1, 2}};
    body(25, BodyKind::kDeformable, 0.05);
    for (int v = 0; v < 25; ++v) {
      x[3 * (6 + v)] += 0.2 * (v / 5);
      x[3 * (6 + v) + 1] += 0.2 * (v % 5);
    }
    append(testing::grid(4), 6);
    body(4, BodyKind::kRigid, 0.4);
    append(testing::tetrahedron(), 31);
    body(3, BodyKind::kStatic, 0.6);
    append({{0, 1, 2}}, 35);
    Body ground{"ground", scene.vertex_count, 0, BodyKind::kStatic};
    ground.half_space = HalfSpace{{0, 0, -0.4}, {0.1, 0, 1}};
    scene.bodies.push_back(ground);
    if (thick) scene.bodies[0].thickness = 0.05;
  }

  /// The bodies from one number to another go elsewhere.
  std::vector<double> moved(std::size_t first, std::size_t end) {
    std::vector<double> y = x;
    for (std::size_t b = first; b < end; ++b) {
      const Body& body = scene.bodies[b];
      const double shift[3] = {uniform(0.3), uniform(0.3), uniform(0.3)};
      const double bend = body.kind == BodyKind::kRigid ? 0 : 0.1;
      for (std::uint32_t i = 3 * body.first_vertex; i < 3 * (body.first_vertex + body.vertex_count); ++i)
        y[i] += shift[i % 3] + uniform(bend);
    }
    return y;
  }

  double uniform(double most) { return std::uniform_real_distribution<double>(-most, most)(random); }

  std::mt19937 random;
  SceneDescription scene;
  std::vector<double> x;

 private:
  void append(const testing::Faces& faces, int first) {
    for (const auto& [a, b, c] : faces) scene.faces.push_back({a + first, b + first, c + first});
  }
};

std::vector<Question> questions() {
  std::vector<Question> all;
  const auto of_motion = [&](QuestionKind kind, const QuestionOptions& options, bool leave_out = false) {
    all.push_back({kind, options, leave_out});
  };
  for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact})
    of_motion(QuestionKind::kTrial, {.tier = tier, .min_separation = 0.0});
  for (const Report report : {Report::kAll, Report::kEarliest, Report::kCount, Report::kCandidates})
    of_motion(QuestionKind::kTrial, {.report = report});
  of_motion(QuestionKind::kTrial, {.min_separation = 0.1});
  of_motion(QuestionKind::kMaxStep, {});
  of_motion(QuestionKind::kMaxStep, {.min_separation = 0.1}, true);
  of_motion(QuestionKind::kMaxStep, {.keep_distance = 0.3});
  for (const Where where : {Where::kBase, Where::kTrialEnd}) {
    all.push_back(Question::proximity(0, where, {}));
    all.push_back(Question::proximity(0.2, where, {.reduced = true}));
    all.push_back(Question::vertex_distances(0.1, where, {}));
    for (const Report report : {Report::kAll, Report::kAny})
      all.push_back(Question::intersections(where, {.report = report}));
  }
  return all;
}

class InTurn : public ::testing::TestWithParam<std::tuple<FrontMode, std::uint32_t, bool>> {};
INSTANTIATE_TEST_SUITE_P(Fronts, InTurn,
                         ::testing::Combine(::testing::Values(FrontMode::kPaper, FrontMode::kWarm),
                                            ::testing::Values(1U, 8U), ::testing::Bool()));

TEST_P(InTurn, EachAnswersAsIfItWereTheFirst) {
  const auto [front, leaf_size, thick] = GetParam();
  const std::vector<Question> all = questions();
  const auto workers = std::make_shared<Workers>(1);
  const ColliderOptions options{.min_separation = thick ? 0 : 0.03, .front = front, .leaf_size = leaf_size};
  std::size_t contacts = 0;
  for (std::uint32_t seed = 0; seed < 2; ++seed) {
    Mixture mixture(seed, thick);
    const auto scene = std::make_shared<const Scene>(Scene::create(mixture.scene).value());
    const auto create = [&] { return Collider::create(scene, Doubles(mixture.x), options, workers).value(); };
    for (const std::size_t first : {0U, 1U}) {  // the rods rest, or do not
      const std::vector<double> other = mixture.moved(first, 3);
      const std::vector<double> whole = mixture.moved(first, 3);
      std::vector<double> half(whole.size());
      for (std::size_t i = 0; i < half.size(); ++i) half[i] = 0.5 * (mixture.x[i] + whole[i]);
      std::vector<Told> expected;
      std::vector<Told> of_half;
      for (const Question& question : all) {
        const auto of_fresh = [&](const std::vector<double>& to) {
          Collider fresh = create();
          EXPECT_TRUE(fresh.trial(Doubles(to)).ok());
          return ask(fresh, to, question);
        };
        expected.push_back(of_fresh(whole));
        of_half.push_back(of_fresh(half));
      }
      Collider collider = create();
      for (std::size_t a = 0; a < all.size(); ++a) {
        if (!expected[a].error.empty()) continue;  // what is thick has no tier fast
        for (std::size_t b = 0; b < all.size(); ++b) {
          SCOPED_TRACE("seed " + std::to_string(seed) + ", question " + std::to_string(b) + " after " +
                       std::to_string(a) + (first == 0 ? "" : ", the rods at rest"));
          ASSERT_TRUE(collider.trial(Doubles(other)).ok());
          ASSERT_TRUE(collider.trial(Doubles(whole)).ok());
          ASSERT_EQ(ask(collider, whole, all[a]), expected[a]);
          ASSERT_EQ(ask(collider, whole, all[b]), expected[b]);
          if (all[b].of_state()) continue;
          ASSERT_EQ(ask(collider, half, all[b]), of_half[b]) << "of half of it";
        }
      }
      contacts += expected[3].contacts.size();
    }
  }
  EXPECT_GT(contacts, 40U);
}

}  // namespace
}  // namespace warmfront
