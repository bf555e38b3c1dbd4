// SPDX-License-Identifier: Apache-2.0
// Invariance of answers: under the order of vertices and of primitives, the direction of time, exact
// translations, scaling by powers of two, and the number of threads. For the elementary tests on torture
// queries, and for the collider on random scenes. The exact tier's decisions and times are equal; the
// certified tier, whose proofs may succeed in one form only, never contradicts the truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "engine/collider.h"
#include "engine/elementary/elementary_test.h"
#include "tests/support/exact_oracle.h"
#include "tests/support/scenes.h"
#include "tests/support/torture.h"

namespace warmfront {
namespace {

using testing::ExactTruth;
using testing::FeatureCase;

// Always RapidCheck's nominal size: small sizes would repeat the same few seeds.
std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

Verdict test(const FeatureCase& query, Tier tier) {
  ElementaryCounts counts;
  return elementary_test(query.features(), {.tier = tier}, counts);
}

std::string torture_name(std::mt19937_64& random, FeatureCase& query) {
  const auto families = testing::torture_families();
  const auto& family = families[random() % families.size()];
  query = family.make(random, random() % 2 == 0 ? ContactKind::kVertexFace : ContactKind::kEdgeEdge);
  return std::string(family.name);
}

// The query has this true answer in the certified and exact tiers; `same_time` says whether its toi is known,
// too.
void expect_truth(const FeatureCase& query, const ExactTruth& truth, bool same_time) {
  const Verdict certified = test(query, Tier::kCertified);
  if (truth.contact) {
    RC_ASSERT(certified.contact);
    if (same_time) RC_ASSERT(certified.toi <= truth.toi);
  } else {
    RC_ASSERT(!certified.contact || certified.status != ContactStatus::kHit);
  }
  const Verdict exact = test(query, Tier::kExact);
  RC_ASSERT(exact.contact == truth.contact);
  if (truth.contact && same_time) RC_ASSERT(exact.toi == truth.toi);
}

// `change` transforms the query; the true answer does not change.
template <class Change>
void check_change(bool same_time, Change&& change) {
  std::mt19937_64 random = draw_random();
  for (int repetition = 0; repetition < 10; ++repetition) {
    FeatureCase query(ContactKind::kVertexFace, testing::kTriangleBelow, testing::kTriangleBelow);
    const std::string family = torture_name(random, query);
    const ExactTruth truth = testing::exact_truth(query.features());
    FeatureCase changed = query;
    change(random, changed);
    RC_LOG() << family << " " << to_text(query) << "\nbecomes " << to_text(changed) << "\n";
    expect_truth(changed, truth, same_time);
  }
}

RC_GTEST_PROP(Invariance, OrderOfVerticesWithinAPrimitive, ()) {
  check_change(true, [](std::mt19937_64& random, FeatureCase& query) {
    auto& v = query.vertices;
    if (query.kind == ContactKind::kVertexFace) {
      std::shuffle(v.begin() + 1, v.end(), random);
    } else {
      if (random() % 2 == 0) std::swap(v[0], v[1]);
      if (random() % 2 == 0) std::swap(v[2], v[3]);
    }
  });
}

RC_GTEST_PROP(Invariance, OrderOfTheEdges, ()) {
  check_change(true, [](std::mt19937_64&, FeatureCase& query) {
    if (query.kind == ContactKind::kVertexFace) return;
    std::swap(query.vertices[0], query.vertices[2]);
    std::swap(query.vertices[1], query.vertices[3]);
  });
}

RC_GTEST_PROP(Invariance, OrderAndSignOfTheAxes, ()) {
  check_change(true, [](std::mt19937_64& random, FeatureCase& query) {
    std::array<int, 3> axis{0, 1, 2};
    std::shuffle(axis.begin(), axis.end(), random);
    const double sign = random() % 2 == 0 ? 1 : -1;
    for (VertexMotion& vertex : query.vertices) {
      for (auto* p : {&vertex.t0, &vertex.t1})
        *p = {sign * (*p)[axis[0]], (*p)[axis[1]], sign * (*p)[axis[2]], 0};
    }
  });
}

RC_GTEST_PROP(Invariance, DirectionOfTime, ()) {
  check_change(false, [](std::mt19937_64&, FeatureCase& query) {
    for (VertexMotion& vertex : query.vertices) std::swap(vertex.t0, vertex.t1);
  });
}

template <class Visit>
void each_coordinate(FeatureCase& query, Visit&& visit) {
  for (VertexMotion& vertex : query.vertices) {
    for (auto* p : {&vertex.t0, &vertex.t1}) {
      for (int axis = 0; axis < 3; ++axis) visit((*p)[axis], axis);
    }
  }
}

// By what keeps every sum exact; where nothing found does, the query stays where it is.
RC_GTEST_PROP(Invariance, ExactTranslation, ()) {
  check_change(true, [](std::mt19937_64& random, FeatureCase& query) {
    for (int attempt = 0; attempt < 20; ++attempt) {
      const double offset =
          std::ldexp(static_cast<double>(random() % 2001) - 1000, static_cast<int>(random() % 60) - 20);
      FeatureCase moved = query;
      bool exact = true;
      each_coordinate(moved, [&](double& x, int axis) {
        const double by = axis == 1 ? -2 * offset : offset;
        const double sum = x + by;
        exact = exact && sum - by == x && sum - x == by;
        x = sum;
      });
      if (!exact) continue;
      query = moved;
      return;
    }
  });
}

// The verdicts have the same bits in every tier: tests scale a query by a power of two themselves.
RC_GTEST_PROP(Invariance, ScalingByPowersOfTwo, ()) {
  std::mt19937_64 random = draw_random();
  for (int repetition = 0; repetition < 20; ++repetition) {
    FeatureCase query(ContactKind::kVertexFace, testing::kTriangleBelow, testing::kTriangleBelow);
    const std::string family = torture_name(random, query);
    const int exponent = static_cast<int>(random() % 1801) - 900;
    FeatureCase scaled = query;
    bool exact = true;
    each_coordinate(scaled, [&](double& x, int) {
      const double y = std::ldexp(x, exponent);
      // Differences must keep a factor 16 from overflow, too.
      exact = exact && std::ldexp(y, -exponent) == x && std::fabs(x) < 0x1p1020 && std::fabs(y) < 0x1p1020;
      x = y;
    });
    if (!exact) continue;
    RC_LOG() << family << " " << to_text(query) << " by 2^" << exponent << "\n";
    for (const Tier tier : {Tier::kFast, Tier::kCertified, Tier::kExact}) {
      const Verdict before = test(query, tier);
      const Verdict after = test(scaled, tier);
      RC_ASSERT(before.contact == after.contact);
      if (!before.contact) continue;
      RC_ASSERT(before.status == after.status);
      RC_ASSERT(before.toi == after.toi);
    }
  }
}

using Pairs = std::set<std::tuple<ContactKind, std::uint32_t, std::uint32_t>>;

struct SceneStep {
  std::shared_ptr<const Scene> scene;
  std::vector<double> from;
  std::vector<double> to;
};

// Coordinates in 2^-20ths, so that there is room for exact offsets.
SceneStep draw_step(std::mt19937_64& random) {
  const testing::RandomScene start = testing::random_scene(random);
  SceneStep step{start.scene, start.positions, testing::random_motion(random, *start.scene, start.positions)};
  for (auto* positions : {&step.from, &step.to}) {
    for (double& x : *positions) x = std::round(x * 0x1p20) * 0x1p-20;
  }
  return step;
}

std::vector<Contact> contacts(const SceneStep& step, const ColliderOptions& options, int threads) {
  auto collider = Collider::create(step.scene, std::span<const double>(step.from), options,
                                   std::make_shared<Workers>(threads));
  RC_ASSERT(collider.ok());
  auto result = collider.value().step(std::span<const double>(step.to));
  RC_ASSERT(result.ok());
  return {result.value().contacts.begin(), result.value().contacts.end()};
}

Pairs pairs(const std::vector<Contact>& contacts, bool proved_only = false) {
  Pairs result;
  for (const Contact& c : contacts) {
    if (!proved_only || c.status == ContactStatus::kHit) result.insert({c.kind, c.a, c.b});
  }
  return result;
}

std::vector<ColliderOptions> promising_options() {
  return {{.tier = Tier::kCertified}, {.tier = Tier::kExact, .leaf_size = 4}};
}

// A contact that one of the two proves, the other reports; in the exact tier they are equal.
void expect_same_pairs(const std::vector<Contact>& one, const std::vector<Contact>& other, Tier tier) {
  if (tier == Tier::kExact) RC_ASSERT(pairs(one) == pairs(other));
  RC_ASSERT(std::ranges::includes(pairs(one), pairs(other, true)));
  RC_ASSERT(std::ranges::includes(pairs(other), pairs(one, true)));
}

RC_GTEST_PROP(SceneInvariance, ThreadsFrontAndBounds, ()) {
  std::mt19937_64 random = draw_random();
  const SceneStep step = draw_step(random);
  for (ColliderOptions options : promising_options()) {
    const std::vector<Contact> expected = contacts(step, options, 1);
    for (const int threads : {2, 5}) {
      options.front = threads == 2 ? FrontMode::kNone : FrontMode::kPaper;
      options.bounds = threads == 2 ? BoundsKind::kAabb : BoundsKind::kKDop18;
      RC_ASSERT(contacts(step, options, threads) == expected);
    }
  }
}

RC_GTEST_PROP(SceneInvariance, ScalingByPowersOfTwo, ()) {
  std::mt19937_64 random = draw_random();
  const SceneStep step = draw_step(random);
  const int exponent = static_cast<int>(random() % 2001) - 1000;
  SceneStep scaled = step;
  for (auto* positions : {&scaled.from, &scaled.to}) {
    for (double& x : *positions) x = std::ldexp(x, exponent);
  }
  for (const ColliderOptions& options : promising_options()) {
    RC_ASSERT(contacts(scaled, options, 1) == contacts(step, options, 1));
  }
}

RC_GTEST_PROP(SceneInvariance, ExactTranslation, ()) {
  std::mt19937_64 random = draw_random();
  const SceneStep step = draw_step(random);
  SceneStep moved = step;
  const double by = std::ldexp(static_cast<double>(random() % 1000), static_cast<int>(random() % 16));
  for (auto* positions : {&moved.from, &moved.to}) {
    for (std::size_t k = 0; k < positions->size(); ++k) (*positions)[k] += k % 3 == 1 ? -by : by;
  }
  for (const ColliderOptions& options : promising_options()) {
    const std::vector<Contact> here = contacts(step, options, 2);
    const std::vector<Contact> there = contacts(moved, options, 2);
    expect_same_pairs(here, there, options.tier);
    if (options.tier == Tier::kExact) RC_ASSERT(here == there);
  }
}

RC_GTEST_PROP(SceneInvariance, DirectionOfTime, ()) {
  std::mt19937_64 random = draw_random();
  const SceneStep step = draw_step(random);
  const SceneStep back{step.scene, step.to, step.from};
  for (ColliderOptions options : promising_options()) {
    // Cones leave out what is flat at both ends, which certified can report as possible.
    options.normal_cones = false;
    expect_same_pairs(contacts(step, options, 2), contacts(back, options, 2), options.tier);
  }
}

}  // namespace
}  // namespace warmfront
