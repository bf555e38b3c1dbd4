// SPDX-License-Identifier: Apache-2.0
// The whole pipeline against brute force, over random scenes: hierarchy, front, ownership, orphans and cones
// together must find exactly the contacts that testing every pair finds.
#include "engine/collider.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <tuple>

#include "tests/support/brute_force.h"
#include "tests/support/draws.h"
#include "tests/support/fewer_cases.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::random_motion;
using testing::random_scene;

using testing::workers;

// Always RapidCheck's nominal size: small sizes would repeat the same few seeds.
std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

ColliderOptions draw_options() {
  ColliderOptions options;
  options.front = *rc::gen::element(FrontMode::kNone, FrontMode::kPaper, FrontMode::kWarm);
  options.bounds = *rc::gen::element(BoundsKind::kAabb, BoundsKind::kKDop18);
  options.leaf_size = *rc::gen::element(1U, 2U, 4U, 8U, 16U, 32U, 64U);
  options.min_separation = *rc::gen::element(0.0, 0.0, 0.0, 0.01, 0.3);
  options.rebuild_every_steps = *rc::gen::element(0U, 2U);
  options.normal_cones = false;
  options.lazy_front = *rc::gen::arbitrary<bool>();
  return options;
}

Collider make(const testing::RandomScene& start, const ColliderOptions& options) {
  auto collider = Collider::create(start.scene, std::span<const double>(start.positions), options, workers());
  RC_ASSERT(collider.ok());
  return std::move(collider).value();
}

// 1,200 scenes of four steps each.
RC_GTEST_PROP(Collider, EqualsBruteForce, ()) {
  std::mt19937_64 random = draw_random();
  for (int repetition = 0; repetition < 12; ++repetition) {
    testing::RandomScene state = random_scene(random);
    const ColliderOptions options = draw_options();
    Collider collider = make(state, options);
    const CertifiedOptions certified{.tolerance = options.tolerance,
                                     .min_separation = options.min_separation};
    for (int step = 0; step < 4; ++step) {
      const auto next = random_motion(random, *state.scene, state.positions);
      const auto expected = testing::brute_force(*state.scene, state.positions, next, certified);
      const auto result = collider.step(std::span<const double>(next));
      RC_ASSERT(result.ok());
      RC_ASSERT(std::ranges::equal(result.value().contacts, expected));
      RC_ASSERT(collider.self_check().ok());
      state.positions = next;
    }
  }
}

// The exact tier with a separation: brute force over its own test, warm, cold and in all fronts, with what is
// found of rigid motion and planes; and no contact that the certified tier lacks or finds later.
RC_GTEST_PROP(Collider, ExactWithASeparationEqualsBruteForce, ()) {
  std::mt19937_64 random = draw_random();
  for (int repetition = 0; repetition < 4; ++repetition) {
    testing::RandomScene state = random_scene(random);
    ColliderOptions options = draw_options();
    options.tier = Tier::kExact;
    options.min_separation = *rc::gen::element(1e-9, 0.01, 0.1, 0.3);
    options.normal_cones = *rc::gen::arbitrary<bool>();
    Collider collider = make(state, options);
    ColliderOptions near = options;
    near.tier = Tier::kCertified;
    Collider certified = make(state, near);
    for (int step = 0; step < 4; ++step) {
      Collider cold = make(state, options);
      const auto next = random_motion(random, *state.scene, state.positions);
      const auto expected =
          testing::brute_force_exact(*state.scene, state.positions, next, options.min_separation);
      const auto result = collider.step(std::span<const double>(next));
      const auto from_cold = cold.step(std::span<const double>(next));
      const auto superset = certified.step(std::span<const double>(next));
      RC_ASSERT(result.ok() && from_cold.ok() && superset.ok());
      RC_ASSERT(std::ranges::equal(result.value().contacts, expected));
      RC_ASSERT(std::ranges::equal(from_cold.value().contacts, expected));
      RC_ASSERT(collider.self_check().ok());
      auto other = superset.value().contacts.begin();
      for (const Contact& contact : expected) {
        while (other != superset.value().contacts.end() &&
               std::tie(other->kind, other->a, other->b) != std::tie(contact.kind, contact.a, contact.b))
          ++other;
        RC_ASSERT(other != superset.value().contacts.end());
        RC_ASSERT(other->toi <= contact.toi);
      }
      state.positions = next;
    }
  }
}

RC_GTEST_PROP(Collider, WarmEqualsCold, ()) {
  std::mt19937_64 random = draw_random();
  testing::RandomScene state = random_scene(random);
  const ColliderOptions options = draw_options();
  Collider warm = make(state, options);
  for (int step = 0; step < 6; ++step) {
    Collider cold = make(state, options);
    const auto next = random_motion(random, *state.scene, state.positions);
    const auto from_warm = warm.step(std::span<const double>(next));
    const auto from_cold = cold.step(std::span<const double>(next));
    RC_ASSERT(from_warm.ok() && from_cold.ok());
    RC_ASSERT(std::ranges::equal(from_warm.value().contacts, from_cold.value().contacts));
    const Status sound = warm.self_check();
    if (!sound) RC_FAIL(sound.error().message);
    // Dropping all cached data must not change an answer.
    if (step == 3) warm.forget_warmth();
    state.positions = next;
  }
}

/// Sheets in one hierarchy, some stationary and some drifting, for a number of steps.
class DriftingSheets : public testing::Draws {
 public:
  explicit DriftingSheets(std::uint64_t seed) : Draws(seed) {
    const int sheets = 3 + below(6);
    const int quads = 2 + below(5);
    testing::Faces faces;
    for (int s = 0; s < sheets; ++s) {
      first_.push_back(state.positions.size());
      for (auto face : testing::grid(quads)) {
        for (auto& v : face) v += static_cast<std::int32_t>(first_.back() / 3);
        faces.push_back(face);
      }
      const std::array<double, 3> at{uniform(1), uniform(1), uniform(0.5)};
      for (int i = 0; i <= quads; ++i) {
        for (int j = 0; j <= quads; ++j)
          state.positions.insert(state.positions.end(),
                                 {at[0] + 1.0 * i / quads, at[1] + 1.0 * j / quads, at[2] + uniform(0.02)});
      }
    }
    first_.push_back(state.positions.size());
    state.scene = testing::make_scene(static_cast<std::uint32_t>(first_.back() / 3), std::move(faces));
    drift_.resize(first_.size() - 1);
  }

  void move() {
    for (std::size_t s = 0; s < drift_.size(); ++s) {
      if (below(6) == 0)
        drift_[s] =
            below(2) == 0 ? std::array{0.0, 0.0, 0.0} : std::array{uniform(0.2), uniform(0.2), uniform(0.2)};
      for (std::size_t i = first_[s]; i < first_[s + 1]; ++i) {
        double& x = state.positions[i];
        if (std::fabs(x) > 2)
          drift_[s][i % 3] = x > 0 ? -std::fabs(drift_[s][i % 3]) : std::fabs(drift_[s][i % 3]);
      }
      for (std::size_t i = first_[s]; i < first_[s + 1]; ++i) state.positions[i] += drift_[s][i % 3];
    }
  }

  testing::RandomScene state;

 private:
  std::vector<std::size_t> first_;  // coordinate of each sheet
  std::vector<std::array<double, 3>> drift_;
};

// Long enough for a lazy front to prune, several times, pairs beside those of stationary leaves.
WARMFRONT_PROPERTY_OF_FEWER_CASES(Collider, LongRunsOfWhatRestsAndMovesLoseNothing) {
  std::mt19937_64 random = draw_random();
  DriftingSheets sheets(random());
  ColliderOptions options = draw_options();
  options.front = FrontMode::kWarm;
  options.leaf_size = *rc::gen::element(1U, 1U, 2U, 8U);
  options.report = *rc::gen::element(Report::kAll, Report::kAll, Report::kEarliest);
  options.find_bodies = false;
  Collider warm = make(sheets.state, options);
  options.front = FrontMode::kNone;
  Collider none = make(sheets.state, options);
  for (int step = 0; step < 60; ++step) {
    sheets.move();
    const auto from_warm = warm.step(std::span<const double>(sheets.state.positions));
    const auto from_none = none.step(std::span<const double>(sheets.state.positions));
    RC_ASSERT(from_warm.ok() && from_none.ok());
    RC_ASSERT(std::ranges::equal(from_warm.value().contacts, from_none.value().contacts));
    const Status sound = warm.self_check();
    if (!sound) RC_FAIL(sound.error().message);
  }
}

// Pairs culled by cones do not meet, but may be near: only the exact tier uses cones, and the other tiers'
// answers do not change.
RC_GTEST_PROP(Collider, NormalConesChangeNoAnswer, ()) {
  std::mt19937_64 random = draw_random();
  testing::RandomScene state = random_scene(random);
  ColliderOptions options = draw_options();
  options.tier = *rc::gen::element(Tier::kCertified, Tier::kExact);
  options.min_separation = 0;
  options.tolerance = *rc::gen::element(1e-6, 1e-2, 0.3);
  Collider without = make(state, options);
  options.normal_cones = true;
  Collider with = make(state, options);
  for (int step = 0; step < 4; ++step) {
    const auto next = random_motion(random, *state.scene, state.positions);
    const auto all = without.step(std::span<const double>(next));
    const auto culled = with.step(std::span<const double>(next));
    RC_ASSERT(all.ok() && culled.ok());
    RC_ASSERT(std::ranges::equal(all.value().contacts, culled.value().contacts));
    state.positions = next;
  }
}

RC_GTEST_PROP(Collider, EarliestAndCountAgreeWithAll, ()) {
  std::mt19937_64 random = draw_random();
  testing::RandomScene state = random_scene(random);
  ColliderOptions options = draw_options();
  Collider all = make(state, options);
  options.report = Report::kEarliest;
  Collider earliest = make(state, options);
  options.report = Report::kCount;
  Collider count = make(state, options);
  for (int step = 0; step < 3; ++step) {
    state.positions = random_motion(random, *state.scene, state.positions);
    const std::span<const double> next(state.positions);
    const auto full = all.step(next);
    const auto first = earliest.step(next);
    const auto counted = count.step(next);
    RC_ASSERT(full.ok() && first.ok() && counted.ok());
    RC_ASSERT(counted.value().vf == full.value().vf);
    RC_ASSERT(counted.value().ee == full.value().ee);
    RC_ASSERT(counted.value().possible == full.value().possible);
    RC_ASSERT(counted.value().contacts.empty());
    RC_ASSERT(counted.value().earliest_toi == full.value().earliest_toi);
    RC_ASSERT(first.value().earliest_toi == full.value().earliest_toi);
    std::vector<Contact> ties;
    std::ranges::copy_if(full.value().contacts, std::back_inserter(ties),
                         [&](const Contact& c) { return c.toi == full.value().earliest_toi; });
    RC_ASSERT(std::ranges::equal(first.value().contacts, ties));
  }
}

}  // namespace
}  // namespace warmfront
