// SPDX-License-Identifier: Apache-2.0
// A look-alike of UNC's cloth-ball: a square cloth falls on a ball, which then spins. Thread safety as in
// model.h.
#include <algorithm>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kBallRadius = 0.5;
constexpr double kClothSide = 2.2;
constexpr Vec3 kBallCenter{0, 0, 0.75};
constexpr int kSubsteps = 8;

Shapes make_shapes(ClothOverBall size) {
  Shapes shapes;
  const double cell = kClothSide / size.cloth;
  const double height = kBallCenter.z + kBallRadius + 0.05;
  shapes.add_grid(size.cloth, size.cloth, false, false, [&](int r, int c) {
    return Vec3{c * cell - kClothSide / 2, r * cell - kClothSide / 2, height};
  });
  shapes.end_body("cloth", BodyKind::kDeformable);
  shapes.add_sphere(size.ball, {}, kBallRadius);
  shapes.end_body("ball", BodyKind::kRigid);
  return shapes;
}

class ClothBall final : public Model {
 public:
  explicit ClothBall(ClothOverBall size)
      : Model(make_shapes(size)),
        cloth_(std::span(shapes_.vertices).first(scene().bodies[0].vertex_count)),
        cell_(kClothSide / size.cloth) {
    cloth_.link_grid(0, size.cloth, size.cloth, false);
    place(1, turned({0, 0, 1}, 0, kBallCenter));
  }

  void advance() override {
    cloth_.find_neighbours(0.7 * cell_);
    const double seconds = kFrameSeconds / kSubsteps;
    for (int s = 0; s < kSubsteps; ++s) {
      time_ += seconds;
      const double spin = 5 * std::clamp(time_ - 0.8, 0.0, 1.0);
      angle_ += spin * seconds;
      // The cloth's particles rest slightly below the mesh's corners, so that the two meshes touch.
      const Obstacle ball{kBallCenter, kBallCenter, 0.998 * kBallRadius, {}, {0, 0, spin}};
      cloth_.substep(seconds, std::span(&ball, 1));
    }
    std::copy(cloth_.positions().begin(), cloth_.positions().end(), positions_.begin());
    place(1, turned({0, 0, 1}, angle_, kBallCenter));
  }

 private:
  Cloth cloth_;
  double cell_;
  double time_ = 0;
  double angle_ = 0;
};

}  // namespace

std::unique_ptr<Model> make_cloth_ball(std::uint32_t triangles) {
  return std::make_unique<ClothBall>(ClothOverBall(triangles));
}

}  // namespace warmfront::client::scenes
