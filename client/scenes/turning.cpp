// SPDX-License-Identifier: Apache-2.0
// Rigid rods in the cells of a grid turn and drift to and fro; each turns by up to a sixth of a turn a frame,
// so that its ends go along arcs which lines between two frames cut short. They go through one another where
// they meet. Nothing does at first. Thread safety as in model.h.
#include <algorithm>
#include <cstdio>

#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr Vec3 kHalfSize{0.012, 0.012, 0.11};  // of a rod
constexpr double kSpacing = 0.225;             // so that ends of neighbours meet where rods drift together
constexpr double kDrift = 0.08;
constexpr double kMostSpin = 60;  // degrees a frame

struct Size {
  explicit Size(std::uint32_t triangles) : cells(triangles < 50'000 ? 3 : 5) {
    rods = std::max(2, static_cast<int>(triangles / (12.0 * cells * cells) + 0.5));
    while (side * side * side < rods) ++side;
  }
  int cells;
  int rods = 0;
  int side = 1;  // rods along an edge of the grid
};

Shapes make_shapes(Size size) {
  Shapes shapes;
  for (int i = 0; i < size.rods; ++i) {
    shapes.add_box(size.cells, {}, kHalfSize);
    char name[32];
    std::snprintf(name, sizeof name, "rod_%03d", i);
    shapes.end_body(name, BodyKind::kRigid);
    shapes.scene.bodies.back().screw = true;
  }
  return shapes;
}

struct Rod {
  Vec3 center;
  Vec3 drift;
  Vec3 axis;
  double spin;   // radians a frame
  double phase;  // of the drift
};

class Turning final : public Model {
 public:
  explicit Turning(Size size) : Model(make_shapes(size)) {
    Random random(1900);
    const auto direction = [&] {
      const Vec3 drawn{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.1, 1)};
      return (1 / norm(drawn)) * drawn;
    };
    for (int i = 0; i < size.rods; ++i) {
      const int x = i % size.side, y = i / size.side % size.side, z = i / (size.side * size.side);
      rods_.push_back({{(x + 0.5) * kSpacing, (y + 0.5) * kSpacing, (z + 0.5) * kSpacing},
                       kDrift * direction(),
                       direction(),
                       random.uniform(-1, 1) * kMostSpin * kPi / 180,
                       random.uniform(0, 2 * kPi)});
    }
    place_rods();
  }

  void advance() override {
    ++frame_;
    place_rods();
  }

 private:
  void place_rods() {
    for (std::size_t i = 0; i < rods_.size(); ++i) {
      const Rod& rod = rods_[i];
      const double swing = sin_cos(rod.phase + 0.1 * frame_).sin - sin_cos(rod.phase).sin;
      place(i, turned(rod.axis, rod.spin * frame_, rod.center + swing * rod.drift));
    }
  }

  std::vector<Rod> rods_;
  int frame_ = 0;
};

}  // namespace

std::unique_ptr<Model> make_turning(std::uint32_t triangles) {
  return std::make_unique<Turning>(Size(triangles));
}

}  // namespace warmfront::client::scenes
