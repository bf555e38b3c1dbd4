// SPDX-License-Identifier: Apache-2.0
// Report::kCandidates: the pairs whose moving bounds overlap, the same however they are found, and a superset
// of what any tier reports.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <tuple>
#include <vector>

#include "engine/collider.h"
#include "tests/support/scenes.h"

namespace warmfront {
namespace {

using Key = std::tuple<ContactKind, std::uint32_t, std::uint32_t>;

class Candidates : public ::testing::Test {
 protected:
  static constexpr int kSide = 7;

  Candidates() {
    for (int i = 0; i <= kSide; ++i)
      for (int j = 0; j <= kSide; ++j) start_.insert(start_.end(), {0.3 * i, 0.3 * j, 0.0});
    end_ = start_;
    std::uniform_real_distribution<double> by(-0.35, 0.35);
    for (double& x : start_) x += by(random_);
    for (double& x : end_) x += by(random_);
  }
  Collider collider(const ColliderOptions& options, int threads = 1) const {
    SceneDescription scene;
    scene.vertex_count = static_cast<std::uint32_t>(start_.size() / 3);
    scene.faces = testing::grid(kSide);
    return Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                            std::span<const double>(start_), options, std::make_shared<Workers>(threads))
        .value();
  }
  std::vector<Contact> step(const ColliderOptions& options, int threads = 1) const {
    Collider one = collider(options, threads);
    const auto answer = one.step(std::span<const double>(end_));
    EXPECT_TRUE(answer.ok());
    return {answer.value().contacts.begin(), answer.value().contacts.end()};
  }
  static std::map<Key, double> by_pair(const std::vector<Contact>& contacts) {
    std::map<Key, double> pairs;
    for (const Contact& c : contacts) pairs[{c.kind, c.a, c.b}] = c.toi;
    return pairs;
  }

  std::mt19937_64 random_{7};
  std::vector<double> start_, end_;
};

TEST_F(Candidates, HoldWhatEveryTierReportsNoLaterThanItDoes) {
  for (const double separation : {0.0, 0.1}) {
    const auto candidates = by_pair(step({.min_separation = separation, .report = Report::kCandidates}));
    std::size_t contacts = 0;
    for (const Tier tier : {Tier::kCertified, Tier::kExact}) {
      if (separation > 0 && tier != Tier::kCertified) continue;
      for (const Contact& contact : step({.tier = tier, .min_separation = separation})) {
        const auto found = candidates.find({contact.kind, contact.a, contact.b});
        ASSERT_NE(found, candidates.end());
        EXPECT_LE(found->second, contact.toi);
        ++contacts;
      }
    }
    EXPECT_GT(contacts, 100U);
    EXPECT_GT(candidates.size(), contacts / 2 + 50) << "most candidates are no contacts";
  }
}

// Along one of the nine axes, the gap between two features is linear in time: the pair is not listed if
// it is positive at both ends, and listed if no axis has a positive gap at a time that both ends of it
// share.
TEST_F(Candidates, AreThosePairsThatNoAxisKeepsApart) {
  const Collider one = collider({});
  const Scene& scene = one.scene();
  const auto listed = by_pair(step({.report = Report::kCandidates}));
  constexpr std::array<std::array<int, 3>, 9> kAxes{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, -1, 0}, {1, 0, -1}, {0, 1, -1}}};
  const auto along = [](const std::vector<double>& at, std::uint32_t v, const std::array<int, 3>& axis) {
    return axis[0] * at[3 * v] + axis[1] * at[3 * v + 1] + axis[2] * at[3 * v + 2];
  };
  int apart = 0, never_apart = 0;
  const auto check = [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
    const auto ids = scene.vertices_of({kind, ContactStatus::kHit, a, b, 0});
    const int first = kind == ContactKind::kVertexFace ? 1 : 2;
    for (int i = 0; i < first; ++i)
      for (int j = first; j < 4; ++j)
        if (ids[i] == ids[j]) return;
    bool apart_throughout = false, apart_at_an_end = false;
    for (const auto& axis : kAxes) {
      for (const int sense : {1, -1}) {
        std::array<double, 2> gap;
        for (const int end : {0, 1}) {
          const auto& at = end == 0 ? start_ : end_;
          double high = -1e300, low = 1e300;
          for (int i = 0; i < first; ++i) high = std::max(high, sense * along(at, ids[i], axis));
          for (int j = first; j < 4; ++j) low = std::min(low, sense * along(at, ids[j], axis));
          gap[end] = low - high;
        }
        // Each pair of vertices by itself is linear; of their least gap only the ends are looked at here.
        apart_throughout |= gap[0] > 1e-9 && gap[1] > 1e-9;
        apart_at_an_end |= gap[0] > -1e-9 || gap[1] > -1e-9;
      }
    }
    const bool is_listed = listed.contains({kind, a, b});
    if (apart_throughout) {
      EXPECT_FALSE(is_listed) << a << " " << b;
      ++apart;
    } else if (!apart_at_an_end) {
      EXPECT_TRUE(is_listed) << a << " " << b;
      EXPECT_EQ(listed.at({kind, a, b}), 0);
      ++never_apart;
    }
  };
  for (std::uint32_t v = 0; v < scene.vertex_count(); ++v)
    for (std::uint32_t f = 0; f < scene.face_count(); ++f) check(ContactKind::kVertexFace, v, f);
  for (std::uint32_t e = 0; e < scene.edges().size(); ++e)
    for (std::uint32_t g = e + 1; g < scene.edges().size(); ++g) check(ContactKind::kEdgeEdge, e, g);
  EXPECT_GT(apart, 1000);
  EXPECT_GT(never_apart, 5);
}

TEST_F(Candidates, AreTheSameHoweverTheyAreFound) {
  const std::vector<Contact> expected = step({.report = Report::kCandidates});
  ASSERT_GT(expected.size(), 200U);
  for (const Contact& one : expected) ASSERT_EQ(one.status, ContactStatus::kBudget);
  for (const FrontMode front : {FrontMode::kNone, FrontMode::kPaper, FrontMode::kWarm})
    for (const BoundsKind bounds : {BoundsKind::kAabb, BoundsKind::kKDop18})
      for (const std::uint32_t leaf : {1U, 64U})
        for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact})
          EXPECT_EQ(step({.tier = tier,
                          .report = Report::kCandidates,
                          .front = front,
                          .bounds = bounds,
                          .leaf_size = leaf},
                         2),
                    expected);
}

TEST_F(Candidates, AreAQuestionLikeAnother) {
  Collider one = collider({});
  const std::span<const double> there(end_);
  const std::vector<Contact> expected = step({.report = Report::kCandidates}), contacts = step({});
  for (int round = 0; round < 3; ++round) {
    const auto listed = one.trial(there, {.report = Report::kCandidates});
    ASSERT_TRUE(listed.ok());
    EXPECT_TRUE(std::ranges::equal(listed.value().contacts, expected));
    EXPECT_EQ(listed.value().possible, expected.size());
    const auto tested = one.trial(there);
    ASSERT_TRUE(tested.ok());
    EXPECT_TRUE(std::ranges::equal(tested.value().contacts, contacts));
  }
  const auto refused = one.trial(there, {.report = Report::kCandidates, .max_contacts = expected.size() - 1});
  EXPECT_EQ(refused.error().code, ErrorCode::kResourceExhausted);
  EXPECT_TRUE(one.trial(there, {.report = Report::kCandidates, .max_contacts = expected.size()}).ok());
}

// Separating planes that an earlier question found do not hold for a motion for which none were
// searched.
TEST(CandidatesOfBodies, ForgetThePlanesBetweenThem) {
  SceneDescription description;
  description.vertex_count = 6;
  description.faces = {{0, 1, 2}, {3, 4, 5}};
  description.bodies = {{"", 0, 3}, {"", 3, 3}};
  // Their bounds along axes overlap; a plane across (1, 2, 3) keeps them apart.
  const std::vector<double> apart = {0,   0,   0,   2,   -1,   0,   0,   3,   -2,
                                     0.1, 0.2, 0.3, 2.1, -0.8, 0.3, 0.1, 3.2, -1.7};
  std::vector<double> through = apart;
  for (int v = 3; v < 6; ++v) through[3 * v + 2] -= 2;
  for (const QuestionOptions& question :
       {QuestionOptions{.report = Report::kCandidates}, QuestionOptions{.tier = Tier::kFast}}) {
    Collider one = Collider::create(std::make_shared<const Scene>(Scene::create(description).value()),
                                    std::span<const double>(apart), {}, std::make_shared<Workers>(1))
                       .value();
    std::vector<double> near = apart;
    for (int v = 3; v < 6; ++v) near[3 * v] += 0.01;
    const auto kept_apart = one.step(std::span<const double>(near));
    ASSERT_TRUE(kept_apart.ok());
    ASSERT_EQ(kept_apart.value().statistics.counts.parts_apart, 1U);
    const auto met = one.trial(std::span<const double>(through), question);
    ASSERT_TRUE(met.ok());
    EXPECT_FALSE(met.value().contacts.empty());
    EXPECT_EQ(met.value().statistics.counts.parts_apart, 0U);
    EXPECT_TRUE(one.self_check().ok()) << one.self_check().error().message;
  }
}

}  // namespace
}  // namespace warmfront
