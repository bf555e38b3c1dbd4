// SPDX-License-Identifier: Apache-2.0
// For any filters, the answer to each question is the unfiltered answer less exactly the pairs that the
// filters leave out, found pair by pair by PairRules: steps, trials, max_step, candidates, proximity and
// intersections; whatever tier, front, bounds, leaves and threads; of deformable, rigid and static bodies;
// warm and cold, after commits, changes of filters, of bodies and of their number. So each pair that is
// left is tested once, whichever pair of faces owned it.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "engine/collider.h"
#include "tests/support/brute_force.h"
#include "tests/support/drawn_bodies.h"
#include "tests/support/max_step_oracle.h"
#include "tests/support/pair_rules.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::DrawnBodies;
using testing::PairRules;

class Filtered : public DrawnBodies {
 public:
  explicit Filtered(std::uint64_t seed) : DrawnBodies(seed) {
    draw_bodies();
    rest_ = x_;
    if (below(3) == 0)
      for (double& x : rest_) x += uniform(0.3);  // another shape than where it begins
    filters_ = draw_filters();
    options_ = draw_options();
    const auto whole = std::make_shared<const Scene>(Scene::create(description_).value());
    SceneDescription described = description_;
    described.filters = filters_;
    const auto filtered = std::make_shared<const Scene>(Scene::create(std::move(described)).value());
    all_.emplace(create(whole));
    some_.emplace(create(filtered));
    take_rules();
  }

  void act() {
    switch (below(12)) {
      case 0:
        return change_filters();
      case 1:
        return change_body();
      case 2:
        return add_body();
      case 3:
        return some_->forget_warmth();
      case 4:
        return ask_of_state(Where::kBase);
      default:
        return move();
    }
  }

  std::uint64_t left_out() const { return left_out_; }

 private:
  PairFilters draw_filters() {
    PairFilters filters;
    const auto n = static_cast<int>(description_.vertex_count);
    if (below(2) == 0) filters.within_edges = static_cast<std::uint32_t>(below(4));
    if (below(3) == 0) {
      filters.near_at_rest = 0.05 * (1 + below(8));
      filters.rest_positions = rest_;
    }
    if (below(2) == 0) {
      for (int i = below(6); i > 0; --i) {
        const auto a = static_cast<std::uint32_t>(below(n)), b = static_cast<std::uint32_t>(below(n));
        if (a != b) filters.excluded_vertex_pairs.push_back({a, b});
      }
    }
    if (below(2) == 0) {
      const int patches = 1 + below(3);
      const bool frayed = below(2) == 0;  // else whole nodes of hierarchies are in one
      for (int v = 0; v < n; ++v) {
        // Mostly ranges, as of a mesh that was divided.
        const int of_range = 1 + v * patches / n;
        filters.patches.push_back(
            static_cast<std::uint32_t>(frayed && below(5) == 0 ? below(patches + 1) : of_range));
      }
    }
    return filters;
  }

  ColliderOptions draw_options() {
    ColliderOptions options;
    options.tier = static_cast<Tier>(below(3));
    options.front = static_cast<FrontMode>(below(3));
    options.bounds = static_cast<BoundsKind>(below(3));
    options.leaf_size = 1U << below(7);
    options.lazy_front = below(4) != 0;
    options.find_bodies = below(3) != 0;
    options.normal_cones = below(4) == 0;
    if (options.tier != Tier::kFast && below(2) == 0) options.min_separation = 0.05;
    return options;
  }

  Collider create(const std::shared_ptr<const Scene>& scene) {
    static const auto alone = std::make_shared<Workers>(1);
    return Collider::create(scene, std::span<const double>(x_), options_,
                            below(2) == 0 ? testing::workers() : alone)
        .value();
  }

  void take_rules() {
    scene_ = some_->shared_scene();
    RC_ASSERT(scene_->filters() == filters_);
    rules_.emplace(*scene_, filters_);
  }

  std::vector<Contact> counted(std::span<const Contact> contacts) {
    std::vector<Contact> counted(contacts.begin(), contacts.end());
    left_out_ += std::erase_if(counted, [&](const Contact& c) { return rules_->leave_out(c); });
    return counted;
  }

  void change_filters() {
    filters_ = below(4) == 0 ? PairFilters() : draw_filters();
    RC_ASSERT(some_->change_filters(filters_).ok());
    take_rules();
  }

  void change_body() {
    if (description_.bodies.empty()) return;
    const auto b = static_cast<std::uint32_t>(below(static_cast<int>(description_.bodies.size())));
    Body& body = description_.bodies[b];
    body.kind = static_cast<BodyKind>(below(3));
    body.self_collision = below(4) != 0;
    RC_ASSERT(all_->change_body(b, body).ok());
    RC_ASSERT(some_->change_body(b, body).ok());
    take_rules();
  }

  void add_body() {
    if (description_.bodies.empty() || description_.bodies.size() > 4) return;
    auto [addition, rows] = draw_shape();
    std::vector<SceneChange> changes;
    changes.emplace_back(AddBody{addition, rows});
    RC_ASSERT(all_->change(changes).ok());
    append(addition, rows);
    rest_.insert(rest_.end(), rows.begin(), rows.end());
    if (filters_.near_at_rest > 0)
      filters_.rest_positions.insert(filters_.rest_positions.end(), rows.begin(), rows.end());
    if (!filters_.patches.empty()) filters_.patches.resize(description_.vertex_count);
    if (below(2) == 0) {
      filters_ = draw_filters();
      changes.emplace_back(ChangeFilters{filters_});
    }
    RC_ASSERT(some_->change(changes).ok());
    take_rules();
  }

  void move() {
    const std::vector<double> y = draw_motion(*scene_);
    const std::span<const double> there = y;
    QuestionOptions question;
    if (below(3) == 0) question.tier = static_cast<Tier>(below(3));
    if (below(4) == 0 || question.tier == Tier::kFast) question.min_separation = 0;
    if (below(4) == 0) question.report = Report::kCandidates;
    if (below(3) == 0) {
      expect_same(all_->step(there, nullptr, {}, question), some_->step(there, nullptr, {}, question));
      x_ = y;
      return;
    }
    if (below(2) == 0) expect_max_step(y);
    expect_same(all_->trial(there, question), some_->trial(there, question));
    if (below(3) == 0) expect_as_cold(y, question);
    if (below(2) == 0) {  // part of the way
      std::vector<double> z = x_;
      for (std::size_t i = 0; i < z.size(); ++i) z[i] += 0.5 * (y[i] - x_[i]);
      expect_same(all_->trial(std::span<const double>(z), question),
                  some_->trial(std::span<const double>(z), question));
    }
    if (below(2) == 0) ask_of_state(Where::kTrialEnd);
    if (below(2) == 0) {
      const double fraction = below(2) == 0 ? 1 : 0.375;
      RC_ASSERT(all_->commit(fraction).ok());
      RC_ASSERT(some_->commit(fraction).ok());
    }
    x_ = all_->positions();
    RC_ASSERT(some_->positions() == x_);
  }

  void expect_same(const Result<StepResult>& all, const Result<StepResult>& some) {
    if (!all) RC_FAIL(all.error().message);
    if (!some) RC_FAIL(some.error().message);
    const std::vector<Contact> expected = counted(all.value().contacts);
    RC_ASSERT(std::ranges::equal(some.value().contacts, expected));
    const StepCounts& without = all.value().statistics.counts;
    const StepCounts& with = some.value().statistics.counts;
    RC_ASSERT(without.feature_pairs_filtered + without.triangle_pairs_filtered == 0U);
    if (!filters_.any()) RC_ASSERT(with.feature_pairs_filtered + with.triangle_pairs_filtered == 0U);
  }

  // What a collider that was created just now answers.
  void expect_as_cold(const std::vector<double>& y, const QuestionOptions& question) {
    Collider cold = create(scene_);
    const std::span<const double> there = y;
    const Result<StepResult> answer = cold.trial(there, question);
    RC_ASSERT(std::ranges::equal(answer.value().contacts, some_->trial(there, question).value().contacts));
  }

  void expect_max_step(const std::vector<double>& y) {
    const std::span<const double> there = y;
    QuestionOptions question{.tier = below(2) == 0 ? Tier::kCertified : Tier::kExact};
    const bool leave_out = below(2) == 0;
    double earliest = 1;
    bool any = false;
    const auto take = [&](const Contact& contact) {
      if (leave_out && contact.status == ContactStatus::kOverlapAtStart) return;
      any = true;
      earliest = std::min(earliest, contact.toi);
    };
    if (below(3) == 0) question.keep_distance = 0.2;
    const std::vector<VertexMotion> vertices = testing::motion_between(x_, y);
    testing::for_all_pairs(*scene_, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
      Contact contact{kind, ContactStatus::kHit, a, b, 0};
      const bool of_points = kind == ContactKind::kVertexEdge || kind == ContactKind::kVertexVertex;
      if (of_points && !question.keep_distance && options_.min_separation == 0) return;
      const auto v = scene_->vertices_of(contact);
      if (!may_meet(scene_->body_of_vertex()[v[0]], scene_->body_of_vertex()[v[3]])) return;
      if (rules_->leave_out(contact)) return;
      const FeatureVertices features = testing::features_of(*scene_, vertices, kind, a, b);
      const Verdict verdict = testing::max_step_verdict(features, question, leave_out, options_, 0);
      if (!verdict.contact) return;
      contact.status = verdict.status;
      contact.toi = verdict.toi;
      take(contact);
    });
    const Result<MaxStep> far = some_->max_step(there, leave_out, question);
    if (!far) RC_FAIL(far.error().message);
    RC_ASSERT(far.value().fraction == earliest);
    RC_ASSERT(far.value().first.has_value() == any);
  }

  void ask_of_state(Where where) {
    QuestionOptions question;
    if (below(2) == 0) question.tier = below(2) == 0 ? Tier::kCertified : Tier::kExact;
    constexpr std::array kDistances{0.0, 0.02, 0.1, 0.5};
    const double distance = kDistances[static_cast<std::size_t>(below(4))];
    const std::vector<Contact> near = counted(all_->proximity(distance, where, question).value().contacts);
    for (int repetition = 1 + below(2); repetition > 0; --repetition)
      RC_ASSERT(std::ranges::equal(some_->proximity(distance, where, question).value().contacts, near));
    question.report = Report::kCount;
    const Result<StepResult> count = some_->proximity(distance, where, question);
    RC_ASSERT(count.value().vf + count.value().ee == near.size());

    const std::vector<Contact> tangled = counted(all_->intersections(where).value().contacts);
    if (below(2) == 0)
      RC_ASSERT(some_->intersections(where, {.report = Report::kAny}).value().ef ==
                std::min<std::size_t>(1, tangled.size()));
    RC_ASSERT(std::ranges::equal(some_->intersections(where).value().contacts, tangled));
    RC_ASSERT(some_->self_check().ok());
  }

  PairFilters filters_;
  std::vector<double> rest_;
  ColliderOptions options_;
  std::optional<Collider> all_;
  std::optional<Collider> some_;
  std::shared_ptr<const Scene> scene_;
  std::optional<PairRules> rules_;
  std::uint64_t left_out_ = 0;
};

TEST(Filters, LeaveOutExactlyTheirPairs) {
  int worlds = 0;
  EXPECT_TRUE(rc::check([&] {
    Filtered world(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
    for (int k = 0; k < 6; ++k) world.act();
    worlds += world.left_out() > 0;
  }));
  EXPECT_GT(worlds, 20);  // it holds, too, of filters that leave nothing out
}

}  // namespace
}  // namespace warmfront
