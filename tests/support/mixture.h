// SPDX-License-Identifier: Apache-2.0
// A scene of all kinds of geometry, and all questions that there are: for tests of what one question leaves
// to the next. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "engine/question.h"
#include "engine/scene.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

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
    append(grid(4), 6);
    body(4, BodyKind::kRigid, 0.4);
    append(tetrahedron(), 31);
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
  void append(const Faces& faces, int first) {
    for (const auto& [a, b, c] : faces) scene.faces.push_back({a + first, b + first, c + first});
  }
};

/// Of a motion and of states, in all tiers and reports.
inline std::vector<Question> all_questions() {
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

}  // namespace warmfront::testing
