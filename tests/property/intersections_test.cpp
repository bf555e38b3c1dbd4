// SPDX-License-Identifier: Apache-2.0
// Intersections: the elementary test against rational arithmetic, on points of few bits (which are coplanar,
// collinear or equal more often than not) at all scales and an ulp beside them; and the collider against
// brute force over all edges and faces, on random scenes, whatever front, bounds and threads, between trials
// and commits.
#include <gmpxx.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "engine/collider.h"
#include "engine/elementary/edge_face.h"
#include "engine/scene/adjacency.h"
#include "tests/support/scenes.h"
#include "tests/support/workers.h"

namespace warmfront {
namespace {

using Rational = mpq_class;
using Vector = std::array<Rational, 3>;

Vector vector_of(const double* x) {
  return {Rational(x[0]), Rational(x[1]), Rational(x[2])};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Rational dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
bool is_zero(const Vector& a) {
  return a[0] == 0 && a[1] == 0 && a[2] == 0;
}
bool in_unit(const Rational& t) {
  return t >= 0 && t <= 1;
}

// Do the closed segments (p, q) and (a, b) have a point in common?
bool segments_meet(const Vector& p, const Vector& q, const Vector& a, const Vector& b) {
  const Vector d = q - p, e = b - a, r = a - p;
  const Vector n = cross(d, e);
  if (!is_zero(n)) {
    const Rational nn = dot(n, n);
    return dot(r, n) == 0 && in_unit(dot(cross(r, e), n) / nn) && in_unit(dot(cross(r, d), n) / nn);
  }
  if (is_zero(d) && is_zero(e)) return is_zero(r);
  if (is_zero(d)) return segments_meet(a, b, p, q);
  if (!is_zero(cross(r, d))) return false;
  const Rational s = dot(r, d) / dot(d, d), t = dot(b - p, d) / dot(d, d);
  return std::max(s, t) >= 0 && std::min(s, t) <= 1;
}

// Do the closed segment (p, q) and the closed triangle (a, b, c) have a point in common? The segment is
// clipped by the triangle's plane and by the planes through its sides.
bool segment_meets_triangle(const std::array<Vector, 5>& x) {
  const auto& [p, q, a, b, c] = x;
  const Vector n = cross(b - a, c - a);
  if (is_zero(n))  // a segment: the longest side is all of it
    return segments_meet(p, q, a, b) || segments_meet(p, q, b, c) || segments_meet(p, q, c, a);
  Rational least = 0, greatest = 1;
  // Keeps the times with at_p + t (at_q - at_p) >= 0.
  const auto keep_above = [&](const Rational& at_p, const Rational& at_q) {
    const Rational slope = at_q - at_p;
    if (slope == 0) {
      if (at_p < 0) greatest = -1;
    } else {
      const Rational t = -at_p / slope;
      if (slope > 0) least = std::max(least, t);
      if (slope < 0) greatest = std::min(greatest, t);
    }
  };
  const Rational height_p = dot(p - a, n), height_q = dot(q - a, n);
  keep_above(height_p, height_q);
  keep_above(-height_p, -height_q);
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &c), std::pair(&c, &a)}) {
    const Vector inward = cross(n, *to - *from);
    keep_above(dot(p - *from, inward), dot(q - *from, inward));
  }
  return least <= greatest;
}

struct Case {
  std::array<VertexMotion, 5> vertices{};

  EdgeFaceVertices view() const {
    EdgeFaceVertices view;
    for (std::size_t k = 0; k < 5; ++k) view[k] = &vertices[k];
    return view;
  }
  bool truth(Instant at) const {
    std::array<Vector, 5> x;
    for (std::size_t k = 0; k < 5; ++k)
      x[k] = vector_of((at == Instant::kStart ? vertices[k].t0 : vertices[k].t1).data());
    return segment_meets_triangle(x);
  }
};

// Points of a small grid, scaled, moved, and some an ulp off.
Case draw_case(std::mt19937_64& random) {
  const int cells = 1 + static_cast<int>(random() % 3);
  constexpr std::array kExponents{0, 0, 0, -40, 60, -1000, 900, -1060};
  const int exponent = kExponents[random() % kExponents.size()];
  const int offset = random() % 3 == 0 ? 1000003 : 0;
  const bool nudged = random() % 3 == 0;
  const bool flat = random() % 3 == 0;
  Case made;
  for (VertexMotion& vertex : made.vertices) {
    for (auto* end : {&vertex.t0, &vertex.t1}) {
      for (int axis = 0; axis < 3; ++axis) {
        const int step =
            flat && axis == 2 ? 0 : static_cast<int>(random() % static_cast<unsigned>(2 * cells + 1)) - cells;
        double x = std::ldexp(step + offset, exponent);
        if (nudged && random() % 4 == 0) x = std::nextafter(x, random() % 2 == 0 ? 1e308 : -1e308);
        (*end)[axis] = x;
      }
    }
  }
  return made;
}

TEST(EdgeFace, EqualsRationalArithmetic) {
  std::mt19937_64 random(2027);
  int meet = 0;
  std::uint64_t exact_tests = 0;
  constexpr int kCases = 30000;
  for (int i = 0; i < kCases; ++i) {
    const Case made = draw_case(random);
    for (const Instant at : {Instant::kStart, Instant::kEnd}) {
      const bool truth = made.truth(at);
      meet += truth ? 1 : 0;
      ASSERT_EQ(edge_meets_face(made.view(), at, exact_tests), truth) << "case " << i;
    }
  }
  EXPECT_GT(meet, kCases / 10);
  EXPECT_LT(meet, 2 * kCases - kCases / 10);
}

TEST(EdgeFace, CoordinatesOfEveryExponent) {
  std::mt19937_64 random(2028);
  std::uint64_t exact_tests = 0;
  for (int i = 0; i < 2000; ++i) {
    Case made;
    for (VertexMotion& vertex : made.vertices) {
      for (int axis = 0; axis < 3; ++axis)
        vertex.t0[axis] = vertex.t1[axis] =
            std::ldexp(static_cast<int>(random() % 7) - 3, static_cast<int>(random() % 2000) - 1060);
    }
    ASSERT_EQ(edge_meets_face(made.view(), Instant::kStart, exact_tests), made.truth(Instant::kStart)) << i;
  }
  EXPECT_GT(exact_tests, 0U);
}

// Products of three differences lie on both sides of the largest double, and so do sums of these.
TEST(EdgeFace, WhereProductsOverflowNoSignIsTakenForSure) {
  std::mt19937_64 random(2029);
  std::uint64_t exact_tests = 0;
  int meet = 0;
  for (int i = 0; i < 8000; ++i) {
    std::uniform_real_distribution<double> coordinate(-std::ldexp(1, 339 + i % 4),
                                                      std::ldexp(1, 339 + i % 4));
    Case made;
    for (VertexMotion& vertex : made.vertices) {
      for (int axis = 0; axis < 3; ++axis) vertex.t0[axis] = vertex.t1[axis] = coordinate(random);
    }
    const bool truth = made.truth(Instant::kStart);
    meet += truth ? 1 : 0;
    ASSERT_EQ(edge_meets_face(made.view(), Instant::kStart, exact_tests), truth) << i;
  }
  EXPECT_GT(meet, 200);
}

std::mt19937_64 draw_random() {
  return std::mt19937_64(*rc::gen::resize(rc::kNominalSize, rc::gen::arbitrary<std::uint64_t>()));
}

bool boxes_apart(const std::vector<double>& x, const Edge& edge, const Face& face) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto of = [&](std::uint32_t v) { return x[std::size_t{3} * v + axis]; };
    const auto [e0, e1] = std::minmax({of(edge[0]), of(edge[1])});
    const auto [f0, f1] = std::minmax({of(face[0]), of(face[1]), of(face[2])});
    if (e1 < f0 || f1 < e0) return true;
  }
  return false;
}

std::vector<Contact> brute_force_meeting(const Scene& scene, const std::vector<double>& x, double toi) {
  std::vector<Contact> meeting;
  for (std::uint32_t e = 0; e < scene.edge_count(); ++e) {
    const Edge& edge = scene.edges()[e];
    for (std::uint32_t f = 0; f < scene.face_count(); ++f) {
      const Face& face = scene.faces()[f];
      if (has_vertex(face, edge[0]) || has_vertex(face, edge[1])) continue;
      if (boxes_apart(x, edge, face)) continue;
      std::array<Vector, 5> points;
      for (std::size_t k = 0; k < 5; ++k)
        points[k] = vector_of(x.data() + std::size_t{3} * (k < 2 ? edge[k] : face[k - 2]));
      if (segment_meets_triangle(points))
        meeting.push_back({ContactKind::kEdgeFace, ContactStatus::kHit, e, f, toi});
    }
  }
  return meeting;
}

// Some vertices go to where another one is, or onto a small grid: what then meets does so exactly.
void make_degenerate(std::mt19937_64& random, std::vector<double>& x) {
  const std::size_t vertices = x.size() / 3;
  for (std::size_t v = 0; v < vertices; ++v) {
    if (random() % 6 == 0) std::copy_n(x.data() + 3 * (random() % vertices), 3, x.data() + 3 * v);
    if (random() % 3 == 0)
      for (int axis = 0; axis < 3; ++axis) x[3 * v + axis] = std::round(8 * x[3 * v + axis]) / 8;
  }
}

std::vector<Contact> list(const Result<StepResult>& result) {
  if (!result) RC_FAIL(result.error().message);
  return {result.value().contacts.begin(), result.value().contacts.end()};
}

std::vector<double> scaled(std::vector<double> x, double unit) {
  for (double& coordinate : x) coordinate *= unit;
  return x;
}

RC_GTEST_PROP(Intersections, EqualBruteForceAndDisturbNothing, ()) {
  std::mt19937_64 random = draw_random();
  testing::RandomScene made = testing::random_scene(random);
  if (random() % 2 == 0) make_degenerate(random, made.positions);
  ColliderOptions options;
  options.tier = static_cast<Tier>(random() % 3);
  options.front = static_cast<FrontMode>(random() % 3);
  options.bounds = static_cast<BoundsKind>(random() % 3);
  options.leaf_size = random() % 2 == 0 ? 64 : 1;
  // In some units products of three lengths are near the largest double.
  const double unit = random() % 6 == 0 ? std::ldexp(1, 339 + static_cast<int>(random() % 4)) : 1;
  if (options.tier != Tier::kFast && random() % 3 == 0) options.min_separation = 0.05 * unit;
  std::vector<double> x = scaled(made.positions, unit);
  Collider asked =
      Collider::create(made.scene, std::span<const double>(x), options, testing::workers()).value();
  Collider beside =
      Collider::create(made.scene, std::span<const double>(x), options, testing::workers()).value();
  const auto ask = [&](Where where, const std::vector<double>& at) {
    const std::vector<Contact> truth = brute_force_meeting(*made.scene, at, where == Where::kBase ? 0 : 1);
    const bool any = !truth.empty();
    if (random() % 2 == 0)
      RC_ASSERT(asked.intersections(where, {.report = Report::kAny}).value().ef == (any ? 1U : 0U));
    for (int repetition = random() % 2 == 0 ? 1 : 2; repetition > 0; --repetition)
      RC_ASSERT(list(asked.intersections(where)) == truth);
    const StepResult counted = asked.intersections(where, {.report = Report::kCount}).value();
    RC_ASSERT(counted.ef == truth.size());
    RC_ASSERT(counted.vf + counted.ee == 0U);
    RC_ASSERT(counted.contacts.empty());
    if (random() % 2 == 0)
      RC_ASSERT(asked.intersections(where, {.report = Report::kAny}).value().ef == (any ? 1U : 0U));
  };
  for (int k = 0; k < 3; ++k) {
    ask(Where::kBase, x);
    std::vector<double> y = testing::random_motion(random, *made.scene, scaled(x, 1 / unit));
    if (random() % 3 == 0) make_degenerate(random, y);
    y = scaled(y, unit);
    const std::span<const double> there = y;
    RC_ASSERT(list(asked.trial(there)) == list(beside.trial(there)));
    ask(Where::kTrialEnd, y);
    if (random() % 2 == 0) RC_ASSERT(asked.proximity(0.02 * unit, Where::kTrialEnd).ok());
    if (random() % 2 == 0) ask(Where::kBase, x);
    const double fraction = random() % 2 == 0 ? 1 : 0.375;
    RC_ASSERT(asked.commit(fraction).value().vf == beside.commit(fraction).value().vf);
    x = beside.positions();
    RC_ASSERT(asked.positions() == x);
    RC_ASSERT(asked.self_check().ok());
  }
}

TEST(Intersections, RefuseWhatTheyDoNotHave) {
  const auto scene = testing::make_scene(4, testing::tetrahedron());
  const std::vector<double> x{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::span<const double> still = x;
  Collider collider = Collider::create(scene, still, {}, testing::workers()).value();
  const auto code = [](const auto& result) {
    return result.ok() ? std::nullopt : std::optional(result.error().code);
  };
  EXPECT_TRUE(collider.intersections().ok());
  EXPECT_EQ(code(collider.intersections(Where::kTrialEnd)), ErrorCode::kFailedPrecondition);
  for (const QuestionOptions& wrong :
       {QuestionOptions{.tier = Tier::kCertified}, QuestionOptions{.tolerance = 1e-3},
        QuestionOptions{.min_separation = 0.1}, QuestionOptions{.report = Report::kEarliest},
        QuestionOptions{.fields = ContactFields{}}})
    EXPECT_EQ(code(collider.intersections(Where::kBase, wrong)), ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(collider.proximity(0.1, Where::kBase, {.report = Report::kAny})),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(code(collider.step(still, nullptr, {}, {.report = Report::kAny})), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace warmfront
