// SPDX-License-Identifier: Apache-2.0
// Every question after every other, of the same motion and of half of it, in a scene of all kinds of
// geometry: what one leaves is all that the next one needs, and each answers as a fresh collider does.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/collider.h"
#include "tests/support/mixture.h"

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

class InTurn : public ::testing::TestWithParam<std::tuple<FrontMode, std::uint32_t, bool>> {};
INSTANTIATE_TEST_SUITE_P(Fronts, InTurn,
                         ::testing::Combine(::testing::Values(FrontMode::kPaper, FrontMode::kWarm),
                                            ::testing::Values(1U, 8U), ::testing::Bool()));

TEST_P(InTurn, EachAnswersAsIfItWereTheFirst) {
  const auto [front, leaf_size, thick] = GetParam();
  const std::vector<Question> all = testing::all_questions();
  const auto workers = std::make_shared<Workers>(1);
  const ColliderOptions options{.min_separation = thick ? 0 : 0.03, .front = front, .leaf_size = leaf_size};
  std::size_t contacts = 0;
  for (std::uint32_t seed = 0; seed < 2; ++seed) {
    testing::Mixture mixture(seed, thick);
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
