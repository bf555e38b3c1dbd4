// SPDX-License-Identifier: Apache-2.0
// Detected bodies, rigid motion and chosen bounds change no contact, in steps, trials and what follows
// commits.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "engine/collider.h"
#include "tests/support/draws.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using testing::workers;

std::vector<double> part_way(const std::vector<double>& from, const std::vector<double>& to, double f) {
  std::vector<double> at(from.size());
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = from[i] + f * (to[i] - from[i]);
  return at;
}

/// Bodies that tumble rigidly, deform, or are stationary, and switch between these. At times they go part of
/// their way only, in straight lines.
class World : public testing::Draws {
 public:
  explicit World(std::uint64_t seed) : Draws(seed) {
    const int bodies = 1 + below(4);
    for (int b = 0; b < bodies; ++b) {
      // Clean shapes, and some that touch themselves everywhere.
      const testing::RandomScene shape = below(3) == 0 ? testing::random_scene(random_) : sheet();
      Body body{"", description.vertex_count, shape.scene->vertex_count()};
      testing::append_elements(*shape.scene, body.first_vertex, description.faces, description.edges);
      description.vertex_count += body.vertex_count;
      bodies_.push_back(body);
      modes_.push_back(kRigid);
      x.insert(x.end(), shape.positions.begin(), shape.positions.end());
    }
    if (below(2) == 0) description.bodies = bodies_;
  }

  void move() {
    if (below(6) == 0) return;
    if (!ahead_.empty() && below(2) == 0) {
      x = part_way(x, ahead_, below(8) / 8.0);
      return;
    }
    if (!ahead_.empty()) x = std::exchange(ahead_, {});
    const std::vector<double> before = x;
    move_whole();
    if (below(4) != 0) return;
    ahead_ = x;
    x = part_way(before, ahead_, below(8) / 8.0);
  }

  /// From there, and of some bodies alone at times.
  std::vector<double> some_of_the_way(const std::vector<double>& from) {
    std::vector<double> at = part_way(from, x, below(9) / 8.0);
    for (const Body& body : bodies_) {
      const auto first = from.begin() + 3 * std::ptrdiff_t{body.first_vertex};
      if (below(4) == 0)
        std::copy_n(first, 3 * std::ptrdiff_t{body.vertex_count}, at.begin() + (first - from.begin()));
    }
    return at;
  }

  void move_whole() {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (below(30) == 0) modes_[b] = static_cast<Mode>(below(4));
      const Body& body = bodies_[b];
      double* first = x.data() + 3 * std::size_t{body.first_vertex};
      if (modes_[b] == kRest) continue;
      if (modes_[b] != kDeform) turn(first, body.vertex_count);
      const double noise = modes_[b] == kDeform ? 0.05 : modes_[b] == kNearly ? noise_ : 0;
      if (noise == 0) continue;
      for (std::size_t i = 0; i < 3 * std::size_t{body.vertex_count}; ++i) first[i] += uniform(noise);
    }
  }

  SceneDescription description;
  std::vector<double> x;

 private:
  enum Mode { kRigid, kNearly, kDeform, kRest };

  // A wavy sheet, folded over at times, so that it is near itself without touching.
  testing::RandomScene sheet() {
    const int n = 2 + below(8);
    testing::RandomScene sheet;
    sheet.scene = testing::make_scene(static_cast<std::uint32_t>((n + 1) * (n + 1)), testing::grid(n));
    const double fold = below(2) == 0 ? 3.0 : 0.5;
    const double phase = uniform(3);
    for (int i = 0; i <= n; ++i) {
      const double angle = fold * i / n;
      for (int j = 0; j <= n; ++j) {
        sheet.positions.push_back(0.4 * std::sin(angle));
        sheet.positions.push_back(static_cast<double>(j) / n + 0.01 * std::sin(7.0 * i + phase));
        sheet.positions.push_back(0.4 * std::cos(angle));
      }
    }
    return sheet;
  }

  void turn(double* x, std::uint32_t count) {
    const double angle = below(wild_ ? 2 : 8) == 0 ? uniform(3) : uniform(0.4);
    const int u = below(3);
    const int v = (u + 1) % 3;
    const double drift[3] = {uniform(0.1), uniform(0.1), uniform(0.1)};
    for (std::uint32_t i = 0; i < count; ++i) {
      double* p = x + 3 * std::size_t{i};
      const double a = p[u];
      const double b = p[v];
      p[u] = std::cos(angle) * a - std::sin(angle) * b;
      p[v] = std::sin(angle) * a + std::cos(angle) * b;
      for (int axis = 0; axis < 3; ++axis) p[axis] += drift[axis];
    }
  }

  const bool wild_ = below(3) == 0;
  const double noise_ = std::pow(10.0, -1.0 - below(12));
  std::vector<Body> bodies_;
  std::vector<Mode> modes_;
  std::vector<double> ahead_;  // where they would have gone
};

RC_GTEST_PROP(Found, ChangesNoContact, (std::uint64_t seed)) {
  World world(seed);
  const auto scene = std::make_shared<const Scene>(Scene::create(world.description).value());
  ColliderOptions found;
  found.tier = world.below(3) == 0 ? Tier::kExact : Tier::kCertified;
  found.leaf_size = 1U << world.below(7);
  if (found.tier == Tier::kCertified) found.tolerance = std::pow(10.0, -1.0 - world.below(8));
  if (world.below(3) == 0) found.min_separation = std::pow(10.0, -1.0 - world.below(6));
  ColliderOptions told = found;
  told.find_bodies = told.find_rigid = false;
  told.bounds = BoundsKind::kKDop18;
  Collider finding = Collider::create(scene, std::span<const double>(world.x), found, workers()).value();
  Collider plain = Collider::create(scene, std::span<const double>(world.x), told, workers()).value();
  static std::uint64_t rigid = 0;
  static std::uint64_t steps = 0;
  for (int step = 0; step < 60; ++step) {
    const std::vector<double> before = world.x;
    world.move();
    while (world.below(4) == 0) {
      const std::vector<double> tried = world.some_of_the_way(before);
      const std::span<const double> at(tried);
      if (world.below(12) == 0) RC_ASSERT(finding.place(Frame(at)).ok() && plain.place(Frame(at)).ok());
      if (const std::atomic<bool> stop = true; world.below(12) == 0)
        static_cast<void>(finding.trial(at, {}, &stop));
      const Result<StepResult> a = finding.trial(at);
      const Result<StepResult> b = plain.trial(at);
      RC_ASSERT(std::ranges::equal(a.value().contacts, b.value().contacts));
      const Where where = world.below(2) == 0 ? Where::kBase : Where::kTrialEnd;
      if (world.below(6) == 0) RC_ASSERT(finding.proximity(0.001, where).ok());
      if (world.below(6) == 0) {
        const Result<StepResult> tangles = finding.intersections(where);
        const Result<StepResult> all = plain.intersections(where);
        RC_ASSERT(std::ranges::equal(tangles.value().contacts, all.value().contacts));
      }
      if (world.below(4) != 0) continue;
      const double taken = world.below(9) / 8.0;
      RC_ASSERT(finding.commit(taken).ok() && plain.commit(taken).ok());
    }
    const std::atomic<bool> stop = world.below(16) == 0;
    Result<StepResult> a = finding.step(std::span<const double>(world.x), &stop);
    if (!a) a = finding.step(std::span<const double>(world.x));  // with little to do it was not stopped
    const Result<StepResult> b = plain.step(std::span<const double>(world.x));
    RC_ASSERT(std::ranges::equal(a.value().contacts, b.value().contacts));
    rigid += a.value().statistics.counts.parts_rigid;
    steps += a.value().statistics.counts.parts;
  }
  // Guards against an empty test: rigid motion is found.
  if (steps > 5'000) RC_ASSERT(100 * rigid > 5 * steps);
}

}  // namespace
}  // namespace warmfront
