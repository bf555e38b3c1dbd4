// SPDX-License-Identifier: Apache-2.0
// A look-alike of UNC's n-body: many rigid balls fly, fall and knock together in a box. Thread safety as in
// model.h.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kRadius = 0.1;         // of the meshes
constexpr double kSolidRadius = 0.093;  // for collisions: slightly less, so that colliding meshes touch
constexpr double kSpacing = 0.27;       // between balls at the start
constexpr double kBounce = 0.9;
constexpr int kSubsteps = 8;
constexpr int kWallCells = 4;

struct Size {
  explicit Size(std::uint32_t triangles) : cells(triangles < 50'000 ? 2 : 3) {
    const double left = triangles - 12.0 * kWallCells * kWallCells;
    balls = std::max(2, static_cast<int>(left / (12 * cells * cells) + 0.5));
    while (side * side * side < balls) ++side;
  }
  int cells;
  int balls = 0;
  int side = 1;  ///< balls along an edge of the box
};

Shapes make_shapes(Size size) {
  Shapes shapes;
  for (int i = 0; i < size.balls; ++i) {
    shapes.add_sphere(size.cells, {}, kRadius);
    char name[32];
    std::snprintf(name, sizeof name, "ball_%03d", i);
    shapes.end_body(name, BodyKind::kRigid);
  }
  const double half = size.side * kSpacing / 2;
  shapes.add_box(kWallCells, {half, half, half}, {half, half, half});
  shapes.end_body("box", BodyKind::kStatic);
  return shapes;
}

struct Ball {
  Vec3 center;
  Vec3 velocity;
  Vec3 axis;
  double spin;
};

class NBody final : public Model {
 public:
  explicit NBody(Size size) : Model(make_shapes(size)), edge_(size.side * kSpacing) {
    Random random(2009);
    for (int i = 0; i < size.balls; ++i) {
      const int x = i % size.side, y = i / size.side % size.side, z = i / (size.side * size.side);
      const double slack = 0.9 * (kSpacing / 2 - kRadius);
      Ball ball;
      ball.center = {(x + 0.5) * kSpacing + random.uniform(-slack, slack),
                     (y + 0.5) * kSpacing + random.uniform(-slack, slack),
                     (z + 0.5) * kSpacing + random.uniform(-slack, slack)};
      ball.velocity = {random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5)};
      const Vec3 axis{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.1, 1)};
      ball.axis = (1 / norm(axis)) * axis;
      ball.spin = random.uniform(-3, 3);
      balls_.push_back(ball);
    }
    place_balls();
  }

  void advance() override {
    const double seconds = kFrameSeconds / kSubsteps;
    find_neighbours();
    for (int s = 0; s < kSubsteps; ++s) {
      time_ += seconds;
      for (Ball& ball : balls_) {
        ball.velocity.z -= seconds * 2;  // gravity on a small world: they keep flying for a while
        ball.center += seconds * ball.velocity;
        for (double Vec3::*axis : {&Vec3::x, &Vec3::y, &Vec3::z})
          bounce(ball.center.*axis, ball.velocity.*axis);
      }
      for (const auto& [i, j] : neighbours_) collide(balls_[i], balls_[j]);
    }
    place_balls();
  }

 private:
  void bounce(double& x, double& velocity) const {
    if (x < kSolidRadius) {
      x = kSolidRadius;
      velocity = kBounce * std::abs(velocity);
    } else if (x > edge_ - kSolidRadius) {
      x = edge_ - kSolidRadius;
      velocity = -kBounce * std::abs(velocity);
    }
  }

  /// Pairs that may meet within the frame: a sweep along x.
  void find_neighbours() {
    std::vector<std::uint32_t> order(balls_.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(balls_[a].center.x, a) < std::pair(balls_[b].center.x, b);
    });
    double speed = 0;
    for (const Ball& ball : balls_) speed = std::max(speed, norm(ball.velocity));
    const double reach = 2 * kSolidRadius + 2 * kFrameSeconds * speed;
    neighbours_.clear();
    for (std::size_t a = 0; a < order.size(); ++a)
      for (std::size_t b = a + 1; b < order.size(); ++b) {
        const Vec3 apart = balls_[order[b]].center - balls_[order[a]].center;
        if (apart.x > reach) break;
        if (dot(apart, apart) < reach * reach) neighbours_.emplace_back(order[a], order[b]);
      }
  }

  static void collide(Ball& a, Ball& b) {
    const Vec3 apart = b.center - a.center;
    const double square = dot(apart, apart);
    if (square >= 4 * kSolidRadius * kSolidRadius || square == 0) return;
    const double distance = std::sqrt(square);
    const Vec3 normal = (1 / distance) * apart;
    const double overlap = 2 * kSolidRadius - distance;
    a.center -= (overlap / 2) * normal;
    b.center += (overlap / 2) * normal;
    const double approach = dot(a.velocity - b.velocity, normal);
    if (approach <= 0) return;
    const Vec3 impulse = ((1 + kBounce) / 2 * approach) * normal;
    a.velocity -= impulse;
    b.velocity += impulse;
  }

  void place_balls() {
    for (std::size_t i = 0; i < balls_.size(); ++i)
      place(i, turned(balls_[i].axis, balls_[i].spin * time_, balls_[i].center));
  }

  double edge_;
  double time_ = 0;
  std::vector<Ball> balls_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours_;
};

}  // namespace

std::unique_ptr<Model> make_n_body(std::uint32_t triangles) {
  return std::make_unique<NBody>(Size(triangles));
}

}  // namespace warmfront::client::scenes
