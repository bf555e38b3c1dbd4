// SPDX-License-Identifier: Apache-2.0
// A cloth falls over a ball that lies on the ground, and comes to rest on both; the ground is a half-space.
// Thread safety as in model.h.
#include <algorithm>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kBallRadius = 0.35;
constexpr double kClothSide = 2.2;
constexpr Vec3 kBallCenter{0, 0, kBallRadius};
constexpr int kSubsteps = 8;

Shapes make_shapes(ClothOverBall size) {
  Shapes shapes;
  const double cell = kClothSide / size.cloth;
  const double height = 2 * kBallRadius + 0.2;
  shapes.add_grid(size.cloth, size.cloth, false, false, [&](int r, int c) {
    return Vec3{c * cell - kClothSide / 2, r * cell - kClothSide / 2, height};
  });
  shapes.end_body("cloth", BodyKind::kDeformable);
  shapes.add_sphere(size.ball, kBallCenter, kBallRadius);
  shapes.end_body("ball", BodyKind::kStatic);
  shapes.add_half_space("ground", {{0, 0, 0}, {0, 0, 1}});
  return shapes;
}

class Ground final : public Model {
 public:
  explicit Ground(ClothOverBall size)
      : Model(make_shapes(size)),
        cloth_(std::span(shapes_.vertices).first(scene().bodies[0].vertex_count)),
        cell_(kClothSide / size.cloth) {
    cloth_.link_grid(0, size.cloth, size.cloth, false);
  }

  void advance() override {
    cloth_.find_neighbours(0.7 * cell_);
    // The cloth's particles rest slightly below the mesh's corners, so that the two meshes touch; and on the
    // ground itself.
    const Obstacle ball{kBallCenter, kBallCenter, 0.998 * kBallRadius, {}, {}};
    for (int s = 0; s < kSubsteps; ++s) cloth_.substep(kFrameSeconds / kSubsteps, std::span(&ball, 1));
    std::copy(cloth_.positions().begin(), cloth_.positions().end(), positions_.begin());
  }

 private:
  Cloth cloth_;
  double cell_;
};

}  // namespace

std::unique_ptr<Model> make_ground(std::uint32_t triangles) {
  return std::make_unique<Ground>(ClothOverBall(triangles));
}

}  // namespace warmfront::client::scenes
