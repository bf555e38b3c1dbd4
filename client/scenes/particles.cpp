// SPDX-License-Identifier: Apache-2.0
// Particles, points of a radius, fall on a cloth that hangs from its corners. Thread safety as in model.h.
#include <algorithm>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kSide = 2;
constexpr double kHeight = 1.5;  // the cloth hangs far above the floor that Cloth has
constexpr double kStretch = 1.08;
constexpr int kSubsteps = 8;
// In cells: how near particles come to the cloth and to each other, and what counts as contact.
constexpr double kTouching = 0.55, kThickness = 0.6;
constexpr std::uint32_t kTrianglesAParticle = 20;

struct Size {
  explicit Size(std::uint32_t triangles)
      : cloth(rounded_root(triangles / 2.0, 4)),
        cell(kSide / cloth),
        particles(triangles / kTrianglesAParticle),
        rows(rounded_root(particles / 4.0, 2)) {}
  int cloth;
  double cell;
  std::uint32_t particles;
  int rows;  ///< of particles in a layer, either way
};

Shapes make_shapes(Size size) {
  Shapes shapes;
  shapes.add_grid(size.cloth, size.cloth, false, false, [&](int r, int c) {
    return Vec3{c * size.cell - kSide / 2, r * size.cell - kSide / 2, kHeight};
  });
  shapes.end_body("cloth", BodyKind::kDeformable);
  Random random(2009);
  const double spacing = 0.6 * kSide / size.rows;
  for (std::uint32_t p = 0; p < size.particles; ++p) {
    const auto in_layer = static_cast<int>(p) % (size.rows * size.rows),
               layer = static_cast<int>(p) / (size.rows * size.rows);
    const auto jitter = [&] { return random.uniform(-0.2, 0.2) * spacing; };
    shapes.vertices.push_back({(in_layer % size.rows + 0.5) * spacing - 0.3 * kSide + jitter(),
                               (in_layer / size.rows + 0.5) * spacing - 0.3 * kSide + jitter(),
                               kHeight + 0.1 + layer * spacing + jitter() / 2});
  }
  shapes.end_body("particles", BodyKind::kDeformable);
  shapes.scene.bodies.back().thickness = kThickness * size.cell;
  return shapes;
}

class Particles final : public Model {
 public:
  explicit Particles(Size size) : Model(make_shapes(size)), size_(size), all_(shapes_.vertices) {
    all_.link_grid(0, size.cloth, size.cloth, false);
    const auto of_cloth = static_cast<std::uint32_t>((size.cloth + 1) * (size.cloth + 1));
    for (const int row : {0, size.cloth})
      for (const int column : {0, size.cloth}) {
        const auto corner = static_cast<std::uint32_t>(row * (size.cloth + 1) + column);
        all_.pin(corner);
        for (std::uint32_t p = 0; p < of_cloth; ++p)
          if (p != corner) all_.tether(p, corner, kStretch);
      }
    for (std::uint32_t p = of_cloth; p < of_cloth + size.particles; ++p) {
      const Vec3 x = shapes_.vertices[p];
      all_.lay_on_grid(p, 0, size.cloth, size.cloth, (x.y + kSide / 2) / size.cell,
                       (x.x + kSide / 2) / size.cell, kTouching * size.cell);
    }
  }

  void advance() override {
    all_.find_neighbours(kTouching * size_.cell);
    for (int s = 0; s < kSubsteps; ++s) all_.substep(kFrameSeconds / kSubsteps, {});
    std::copy(all_.positions().begin(), all_.positions().end(), positions_.begin());
  }

 private:
  Size size_;
  Cloth all_;  // the particles too, linked to nothing
};

}  // namespace

std::unique_ptr<Model> make_particles(std::uint32_t triangles) {
  return std::make_unique<Particles>(Size(triangles));
}

}  // namespace warmfront::client::scenes
