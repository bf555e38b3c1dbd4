// SPDX-License-Identifier: Apache-2.0
// A look-alike of the BART robots scene's kind of motion: a few small rigid bodies, each on a path of its own
// - a swinging door, a fan, an arm of three links, balls that bounce, and pairs of linked tori. Thread safety
// as in model.h.
#include <algorithm>
#include <utility>

#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr int kBalls = 6;
constexpr int kTori = 8;  // four linked pairs
constexpr int kLinks = 3;
constexpr double kBallRadius = 0.12;
constexpr double kRing = 0.30;
constexpr double kTube = 0.07;
constexpr double kLinkLength = 0.55;
constexpr double kJoint = 0.06;  // from a link's end to its joint, so that links may bend

/// Cells a side of boxes and balls, and round the tube and the ring of a torus.
struct Size {
  explicit Size(std::uint32_t triangles) {
    cells = std::max(1, cube_cells(0.4 * triangles / (4 + 5 + kLinks + kBalls), 1));
    const double left = triangles - 12.0 * cells * cells * (4 + 5 + kLinks + kBalls);
    tube = rounded_root(left / kTori / 4, 4);
  }
  int cells;
  int tube;
};

Shapes make_shapes(Size size) {
  Shapes shapes;
  const int n = size.cells;
  shapes.add_box(n, {0, 0, -0.05}, {2.5, 2.5, 0.05});
  shapes.end_body("floor", BodyKind::kStatic);
  shapes.add_box(n, {-0.06, 1.5, 0.76}, {0.05, 0.05, 0.75});
  shapes.end_body("post_left", BodyKind::kStatic);
  shapes.add_box(n, {1.06, 1.5, 0.76}, {0.05, 0.05, 0.75});
  shapes.end_body("post_right", BodyKind::kStatic);
  shapes.add_box(n, {0.5, 0, 0.7}, {0.49, 0.02, 0.65});  // hinged at the origin
  shapes.end_body("door", BodyKind::kRigid);
  shapes.add_sphere(n, {}, 0.1);
  for (int blade = 0; blade < 4; ++blade) {
    const auto [s, c] = sin_cos(blade * kPi / 2);
    shapes.add_cube(n, [s = s, c = c](Vec3 p) {
      const double out = 0.43 + 0.3 * p.x;
      return Vec3{out * c - 0.08 * p.y * s, out * s + 0.08 * p.y * c, 0.01 * p.z + 0.03 * p.y};
    });
  }
  shapes.end_body("fan", BodyKind::kRigid);
  for (int link = 0; link < kLinks; ++link) {
    shapes.add_box(n, {kLinkLength / 2, 0, 0}, {kLinkLength / 2 - kJoint, 0.05, 0.05});
    shapes.end_body("link_" + std::to_string(link), BodyKind::kRigid);
  }
  for (int ball = 0; ball < kBalls; ++ball) {
    shapes.add_sphere(n, {}, kBallRadius);
    shapes.end_body("ball_" + std::to_string(ball), BodyKind::kRigid);
  }
  for (int torus = 0; torus < kTori; ++torus) {
    shapes.add_grid(size.tube, 2 * size.tube, true, true, [&](int r, int c) {
      const SinCos tube = sin_cos(2 * kPi * r / size.tube);
      const SinCos ring = sin_cos(kPi * c / size.tube);
      const double out = kRing + kTube * tube.cos;
      return Vec3{out * ring.cos, out * ring.sin, kTube * tube.sin};
    });
    shapes.end_body("torus_" + std::to_string(torus), BodyKind::kRigid);
  }
  return shapes;
}

class Bart final : public Model {
 public:
  explicit Bart(Size size) : Model(make_shapes(size)) { place_all(); }

  void advance() override {
    time_ += kFrameSeconds;
    place_all();
  }

 private:
  double wave(double frequency, double phase) const {
    return sin_cos(2 * kPi * (frequency * time_ + phase)).sin;
  }

  void place_all() {
    std::size_t body = 3;
    place(body++, turned({0, 0, 1}, 0.9 * wave(0.4, 0), {0, 1.5, 0}));
    place(body++, turned({0, 0, 1}, 4 * time_, {-1.4, -1.4, 1.6}));
    place_arm(body);
    for (int ball = 0; ball < kBalls; ++ball) place_ball(body++, ball);
    for (int pair = 0; pair < kTori / 2; ++pair) {
      // Two rings through each other, at right angles; one turns and shakes, so that they knock.
      const Vec3 center{-1.9 + 1.2 * pair, 0.37, 0.75};
      place(body++, turned({0, 0, 1}, 0.8 * time_ + pair, center));
      const Vec3 shaken = center + Vec3{kRing + 0.17 * wave(0.9, 0.1 * pair), 0.03 * wave(1.3, 0), 0};
      place(body++, turned({1, 0, 0}, kPi / 2 + 0.3 * wave(0.7, 0.25 * pair), shaken));
    }
  }

  void place_arm(std::size_t& body) {
    Vec3 joint{0.2, -1.2, 1.75};
    double angle = 0;
    for (int link = 0; link < kLinks; ++link) {
      angle += (0.5 + 0.4 * link) * wave(0.35, 0.1 * link);
      const Pose pose = turned({0, 1, 0}, angle, joint);
      place(body++, pose);
      joint = pose.apply({kLinkLength, 0, 0});
    }
  }

  void place_ball(std::size_t body, int ball) {
    // Parabolas from bounce to bounce; the lowest point dips a little into the floor.
    const double period = 0.7 + 0.08 * ball;
    const double phase = time_ / period + 0.13 * ball;
    const double u = phase - std::floor(phase);
    const double height = kBallRadius - 0.004 + 4 * (0.3 + 0.1 * ball) * u * (1 - u);
    const Vec3 center{-0.2 + 0.35 * ball, -0.6 + 0.2 * wave(0.25, 0.2 * ball), height};
    place(body, turned({1, 0, 0}, (2 + 0.5 * ball) * time_, center));
  }

  double time_ = 0;
};

}  // namespace

std::unique_ptr<Model> make_bart(std::uint32_t triangles) {
  return std::make_unique<Bart>(Size(triangles));
}

}  // namespace warmfront::client::scenes
