// SPDX-License-Identifier: Apache-2.0
// Strands of edges on a head that turns to and fro. Thread safety as in model.h.
#include <algorithm>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kHeadRadius = 0.5;
constexpr double kLength = 0.9;
constexpr Vec3 kHeadCenter{0, 0, 1.4};
constexpr int kSubsteps = 8;

/// How the elements, edges and triangles, are shared out.
struct Size {
  explicit Size(std::uint32_t elements)
      : strands(rounded_root(0.83 * elements, 4)),
        segments(strands),
        head(cube_cells(elements - 1.0 * strands * segments, 4)) {}
  int strands;
  int segments;
  int head;
};

// Directions spread evenly over the top of the head: on a spiral (Vogel 1979).
Vec3 root_direction(int strand, int strands) {
  const double z = 1 - 0.75 * (strand + 0.5) / strands;
  const SinCos turn = sin_cos(strand * 2.39996322972865332);  // the golden angle
  const double radius = std::sqrt(1 - z * z);
  return {radius * turn.cos, radius * turn.sin, z};
}

Shapes make_shapes(Size size) {
  Shapes shapes;
  for (int s = 0; s < size.strands; ++s) {
    const auto first = static_cast<std::int32_t>(shapes.vertices.size());
    const Vec3 direction = root_direction(s, size.strands);
    for (int k = 0; k <= size.segments; ++k)
      shapes.vertices.push_back(kHeadCenter + (1.01 * kHeadRadius + k * kLength / size.segments) * direction);
    for (int k = 0; k < size.segments; ++k) shapes.scene.edges.push_back({first + k, first + k + 1});
  }
  shapes.end_body("hair", BodyKind::kDeformable);
  shapes.add_sphere(size.head, {}, kHeadRadius);
  shapes.end_body("head", BodyKind::kRigid);
  return shapes;
}

class Hair final : public Model {
 public:
  explicit Hair(Size size)
      : Model(make_shapes(size)),
        size_(size),
        strands_(std::span(shapes_.vertices).first(scene().bodies[0].vertex_count)) {
    for (int s = 0; s < size.strands; ++s) {
      strands_.link_grid(root(s), size.segments, 0, false);
      strands_.pin(root(s));
    }
    place(1, turned({0, 0, 1}, 0, kHeadCenter));
  }

  void advance() override {
    strands_.find_neighbours(0.5 * kLength / size_.segments);
    const double seconds = kFrameSeconds / kSubsteps;
    for (int step = 0; step < kSubsteps; ++step) {
      time_ += seconds;
      const double before = angle_;
      angle_ = 1.2 * std::min(time_, 1.0) * sin_cos(4 * time_).sin;
      const Vec3 spin{0, 0, (angle_ - before) / seconds};
      const Pose head = turned({0, 0, 1}, angle_, kHeadCenter);
      for (int s = 0; s < size_.strands; ++s)
        strands_.move_pinned(root(s), head.apply(1.01 * kHeadRadius * root_direction(s, size_.strands)));
      // The strands lie slightly below the mesh's corners, so that they touch it.
      const Obstacle obstacle{kHeadCenter, kHeadCenter, 0.998 * kHeadRadius, {}, spin};
      strands_.substep(seconds, std::span(&obstacle, 1));
    }
    std::copy(strands_.positions().begin(), strands_.positions().end(), positions_.begin());
    place(1, turned({0, 0, 1}, angle_, kHeadCenter));
  }

 private:
  std::uint32_t root(int strand) const { return static_cast<std::uint32_t>(strand * (size_.segments + 1)); }

  Size size_;
  Cloth strands_;
  double time_ = 0;
  double angle_ = 0;
};

}  // namespace

std::unique_ptr<Model> make_hair(std::uint32_t elements) {
  return std::make_unique<Hair>(Size(elements));
}

}  // namespace warmfront::client::scenes
