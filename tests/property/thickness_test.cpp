// SPDX-License-Identifier: Apache-2.0
// Thick vertices, of bodies and each of their own: each pair is decided by its own separation, as brute force
// decides it pair by pair: in steps, trials, max_step (and keep_distance), candidates, proximity and vertex
// distances; whatever tier, front, bounds, leaves and threads; warm and cold, after commits, and after
// changes of bodies and of their number.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "engine/collider.h"
#include "engine/elementary/candidate.h"
#include "engine/elementary/elementary_test.h"
#include "engine/elementary/proximity.h"
#include "tests/support/brute_force.h"
#include "tests/support/drawn_bodies.h"
#include "tests/support/max_step_oracle.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::DrawnBodies;

class Thick : public DrawnBodies {
 public:
  explicit Thick(std::uint64_t seed) : DrawnBodies(seed) {
    draw_bodies();
    for (Body& body : description_.bodies) body.thickness = draw_thickness();
    if (description_.bodies.empty() || below(2) == 0) {
      const bool few = below(2) == 0;
      for (std::uint32_t v = 0; v < description_.vertex_count; ++v)
        description_.thickness.push_back(few && below(8) != 0 ? 0 : draw_thickness());
    }
    options_ = draw_options();
    scene_ = std::make_shared<const Scene>(Scene::create(description_).value());
    collider_.emplace(create());
  }

  void act() {
    switch (below(10)) {
      case 0:
        return change_body();
      case 1:
        return add_body();
      case 2:
        return collider_->forget_warmth();
      case 3:
        return ask_of_state(Where::kBase, x_);
      default:
        return move();
    }
  }

  std::uint64_t contacts() const { return contacts_; }

 private:
  double draw_thickness() {
    constexpr std::array kThickness{0.0, 0.01, 0.05, 0.2};
    return kThickness[static_cast<std::size_t>(below(4))];
  }

  ColliderOptions draw_options() {
    ColliderOptions options;
    options.tier = below(2) == 0 ? Tier::kCertified : Tier::kExact;
    options.front = static_cast<FrontMode>(below(3));
    options.bounds = static_cast<BoundsKind>(below(3));
    options.leaf_size = 1U << below(7);
    options.lazy_front = below(4) != 0;
    options.find_bodies = below(3) != 0;
    options.find_rigid = below(3) != 0;
    options.normal_cones = below(4) == 0;
    options.explain = below(6) == 0;
    if (below(2) == 0) options.min_separation = 0.05;
    return options;
  }

  Collider create() {
    static const auto alone = std::make_shared<Workers>(1);
    return Collider::create(scene_, std::span<const double>(x_), options_,
                            below(2) == 0 ? testing::workers() : alone)
        .value();
  }

  void change_body() {
    if (description_.bodies.empty()) return;
    const auto b = static_cast<std::uint32_t>(below(static_cast<int>(description_.bodies.size())));
    Body& body = description_.bodies[b];
    if (below(2) == 0) body.kind = static_cast<BodyKind>(below(3));
    body.thickness = draw_thickness();
    RC_ASSERT(collider_->change_body(b, body).ok());
    scene_ = collider_->shared_scene();
  }

  void add_body() {
    if (description_.bodies.empty() || description_.bodies.size() > 4) return;
    auto [addition, rows] = draw_shape();
    addition.body.thickness = draw_thickness();
    RC_ASSERT(collider_->add_body(addition, std::span<const double>(rows)).ok());
    append(addition, rows);
    scene_ = collider_->shared_scene();
  }

  // By the description alone.
  double thickness_of(std::span<const std::uint32_t> vertices) const {
    double most = 0;
    for (const std::uint32_t v : vertices) {
      double of_vertex = 0;
      for (const Body& body : description_.bodies)
        if (v >= body.first_vertex && v < body.first_vertex + body.vertex_count) of_vertex = body.thickness;
      if (v < description_.thickness.size()) of_vertex += description_.thickness[v];
      most = std::max(most, of_vertex);
    }
    return most;
  }

  // Calls visit(contact, features, thickness of both) for each pair that counts in a question with this
  // separation.
  template <class Visit>
  void for_pairs(const std::vector<VertexMotion>& vertices, double separation, Visit&& visit) {
    testing::for_all_pairs(*scene_, true, [&](ContactKind kind, std::uint32_t a, std::uint32_t b) {
      const Contact contact{kind, ContactStatus::kHit, a, b, 0};
      const auto v = scene_->vertices_of(contact);
      if (!may_meet(scene_->body_of_vertex()[v[0]], scene_->body_of_vertex()[v[3]])) return;
      const std::span<const std::uint32_t> all(v);
      const std::size_t of_a = vertices_of_first(kind);
      const double thick = thickness_of(all.first(of_a)) + thickness_of(all.subspan(of_a));
      const bool of_points = kind == ContactKind::kVertexEdge || kind == ContactKind::kVertexVertex;
      if (of_points && separation + thick == 0) return;
      visit(contact, testing::features_of(*scene_, vertices, kind, a, b), thick);
    });
  }

  std::vector<Contact> truth(const std::vector<double>& y, const ColliderOptions& options) {
    const std::vector<VertexMotion> vertices = testing::motion_between(x_, y);
    std::vector<Contact> found;
    for_pairs(vertices, options.min_separation,
              [&](Contact contact, const FeatureVertices& features, double thick) {
                ElementaryCounts counts;
                const Verdict verdict = elementary_test(features,
                                                        {.tier = options.tier,
                                                         .tolerance = options.tolerance,
                                                         .min_separation = options.min_separation + thick},
                                                        counts);
                if (!verdict.contact) return;
                contact.status = verdict.status;
                contact.toi = verdict.toi;
                found.push_back(contact);
              });
    contacts_ += found.size();
    return found;
  }

  void expect(const std::vector<Contact>& expected, const Result<StepResult>& answer) {
    if (!answer) RC_FAIL(answer.error().message);
    RC_ASSERT(std::ranges::equal(answer.value().contacts, expected));
  }

  void move() {
    const std::vector<double> y = draw_motion(*scene_);
    const std::span<const double> there = y;
    QuestionOptions question;
    if (below(3) == 0) question.tier = below(2) == 0 ? Tier::kCertified : Tier::kExact;
    if (below(4) == 0) question.min_separation = 0;
    const std::vector<Contact> expected = truth(y, merged(options_, question));
    if (below(3) == 0) {
      expect(expected, collider_->step(there, nullptr, {}, question));
      x_ = y;
      return;
    }
    if (below(3) == 0) expect_max_step(y);
    expect(expected, collider_->trial(there, question));
    if (below(3) == 0) expect(expected, create().trial(there, question));
    if (below(2) == 0) {  // part of the way
      std::vector<double> z = x_;
      for (std::size_t i = 0; i < z.size(); ++i) z[i] += 0.5 * (y[i] - x_[i]);
      expect(truth(z, merged(options_, question)), collider_->trial(std::span<const double>(z), question));
      expect(expected, collider_->trial(there, question));
    }
    if (below(2) == 0) {
      ask_of_state(Where::kTrialEnd, y);
      if (below(2) == 0) expect(expected, collider_->trial(there, question));
    }
    if (below(3) == 0) expect_candidates(y);
    if (below(2) == 0) RC_ASSERT(collider_->commit(below(2) == 0 ? 1 : 0.375).ok());
    x_ = collider_->positions();
  }

  // None that brute force finds is missing.
  void expect_candidates(const std::vector<double>& y) {
    const std::vector<VertexMotion> vertices = testing::motion_between(x_, y);
    std::vector<Contact> expected;
    for_pairs(vertices, options_.min_separation,
              [&](Contact contact, const FeatureVertices& features, double thick) {
                const Verdict verdict = candidate_test(features, options_.min_separation + thick);
                if (!verdict.contact) return;
                contact.status = verdict.status;
                contact.toi = verdict.toi;
                expected.push_back(contact);
              });
    expect(expected, collider_->trial(std::span<const double>(y), {.report = Report::kCandidates}));
  }

  void expect_max_step(const std::vector<double>& y) {
    const std::vector<VertexMotion> vertices = testing::motion_between(x_, y);
    QuestionOptions question{.tier = below(2) == 0 ? Tier::kCertified : Tier::kExact};
    const bool leave_out = below(2) == 0;
    if (below(2) == 0) question.keep_distance = 0.2;
    double earliest = 1;
    const double asked = question.keep_distance ? 1 : options_.min_separation;
    for_pairs(vertices, asked, [&](const Contact&, const FeatureVertices& features, double thick) {
      const Verdict verdict = testing::max_step_verdict(features, question, leave_out, options_, thick);
      if (!verdict.contact) return;
      if (leave_out && verdict.status == ContactStatus::kOverlapAtStart) return;
      earliest = std::min(earliest, verdict.toi);
    });
    const Result<MaxStep> far = collider_->max_step(std::span<const double>(y), leave_out, question);
    if (!far) RC_FAIL(far.error().message);
    RC_ASSERT(far.value().fraction == earliest);
  }

  void ask_of_state(Where where, const std::vector<double>& at) {
    const std::vector<VertexMotion> vertices = testing::motion_between(at, at);
    constexpr std::array kDistances{0.0, 0.02, 0.1, 0.5};
    const double distance = kDistances[static_cast<std::size_t>(below(4))];
    const double toi = where == Where::kBase ? 0 : 1;
    std::vector<Contact> near;
    std::vector<double> least(scene_->vertex_count(), distance);
    std::vector<double> beyond(scene_->vertex_count(), distance);
    for_pairs(vertices, distance, [&](Contact contact, const FeatureVertices& features, double thick) {
      ElementaryCounts counts;
      const Verdict verdict = proximity_test(
          features, Instant::kStart, {.tier = options_.tier, .min_separation = distance + thick}, counts);
      if (!verdict.contact) return;
      contact.status = verdict.status;
      contact.toi = toi;
      near.push_back(contact);
      const double bound = least_distance(features, Instant::kStart, distance + thick);
      for (const std::uint32_t v : scene_->vertices_of(contact)) {
        least[v] = std::min(least[v], std::max(0.0, bound - thick));
        beyond[v] = std::min(beyond[v], std::max(0.0, (bound - thick) * (1 - 0x1p-40) - 0x1p-48 * thick));
      }
    });
    expect(near, collider_->proximity(distance, where));
    const Result<StepResult> distances = collider_->vertex_distances(distance, where);
    RC_ASSERT(distances.value().vertex_distances.size() == least.size());
    for (std::size_t v = 0; v < least.size(); ++v) {
      RC_ASSERT(distances.value().vertex_distances[v] <= least[v]);
      RC_ASSERT(distances.value().vertex_distances[v] >= beyond[v]);
    }
    // Triangles meet or do not, whatever they are thick.
    Collider thin =
        Collider::create(thin_scene(), std::span<const double>(at), {}, testing::workers()).value();
    const Result<StepResult> meet = thin.intersections();
    const Result<StepResult> tangled = collider_->intersections(where);
    RC_ASSERT(meet.value().ef == tangled.value().ef);
    RC_ASSERT(std::ranges::equal(
        meet.value().contacts, tangled.value().contacts, {},
        [](const Contact& c) { return std::pair(c.a, c.b); },
        [](const Contact& c) { return std::pair(c.a, c.b); }));
    RC_ASSERT(collider_->self_check().ok());
  }

  std::shared_ptr<const Scene> thin_scene() const {
    SceneDescription thin = description_;
    thin.thickness.clear();
    for (Body& body : thin.bodies) body.thickness = 0;
    return std::make_shared<const Scene>(Scene::create(std::move(thin)).value());
  }

  ColliderOptions options_;
  std::shared_ptr<const Scene> scene_;
  std::optional<Collider> collider_;
  std::uint64_t contacts_ = 0;
};

TEST(Thickness, EachPairHasItsOwnSeparation) {
  int worlds = 0;
  EXPECT_TRUE(rc::check([&] {
    Thick world(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
    for (int k = 0; k < 6; ++k) world.act();
    worlds += world.contacts() > 0;
  }));
  EXPECT_GT(worlds, 20);
}

}  // namespace
}  // namespace warmfront
