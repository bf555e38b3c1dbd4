// SPDX-License-Identifier: Apache-2.0
// A cloth that is held on two sides is drawn down over a ball and torn along its middle, from one side to the
// other; its halves are drawn off. The vertices of the seam are there twice, a little apart, and come apart
// as it tears: the topology stays. Thread safety as in model.h.
#include <algorithm>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr double kBallRadius = 0.45;
constexpr double kSide = 2;
constexpr Vec3 kBallCenter{0, 0, 0.9};
constexpr double kHeight = 0.9 + kBallRadius + 0.03;
constexpr double kSeam = 0.1;      // how far apart its sides are, in cells
constexpr double kFarthest = 1.6;  // of the sides that are held, from the middle
constexpr int kSubsteps = 10;
constexpr int kFirstTorn = 10, kLastTorn = 45;  // frames

struct Size {
  explicit Size(std::uint32_t triangles) : ball(cube_cells(0.06 * triangles, 4)) {
    // Two halves of `rows` x `columns` cells each, which are about square.
    columns = rounded_root((triangles - 12.0 * ball * ball) / 8, 3);
    rows = 2 * columns;
  }
  int ball, columns = 0, rows = 0;
  double cell() const { return kSide / rows; }
  std::uint32_t vertex(int half, int row, int column) const {
    return static_cast<std::uint32_t>((half * (rows + 1) + row) * (columns + 1) + column);
  }
};

Shapes make_shapes(const Size& size) {
  Shapes shapes;
  const double cell = size.cell();
  for (int half = 0; half < 2; ++half) {
    const double left = half == 0 ? -kSide / 2 - kSeam * cell / 2 : kSeam * cell / 2;
    shapes.add_grid(size.rows, size.columns, false, false, [&](int r, int c) {
      return Vec3{left + c * cell, r * cell - kSide / 2, kHeight};
    });
  }
  shapes.end_body("cloth", BodyKind::kDeformable);
  shapes.add_sphere(size.ball, kBallCenter, kBallRadius);
  shapes.end_body("ball", BodyKind::kStatic);
  return shapes;
}

class Torn final : public Model {
 public:
  explicit Torn(const Size& size)
      : Model(make_shapes(size)),
        size_(size),
        cloth_(std::span(shapes_.vertices).first(scene().bodies[0].vertex_count)) {
    for (int half = 0; half < 2; ++half)
      cloth_.link_grid(size.vertex(half, 0, 0), size.rows, size.columns, false);
    for (int r = 0; r <= size.rows; ++r) {
      cloth_.tie(size.vertex(0, r, size.columns), size.vertex(1, r, 0));
      for (const std::uint32_t p : {size.vertex(0, r, 0), size.vertex(1, r, size.columns)}) {
        cloth_.pin(p);
        held_.push_back(p);
      }
    }
  }

  void advance() override {
    ++frame_;
    const int torn = std::clamp((size_.rows + 1) * (frame_ - kFirstTorn) / (kLastTorn - kFirstTorn), torn_,
                                size_.rows + 1);
    for (; torn_ < torn; ++torn_)
      cloth_.untie(size_.vertex(0, torn_, size_.columns), size_.vertex(1, torn_, 0));
    cloth_.find_neighbours(0.7 * size_.cell());
    const Obstacle ball{kBallCenter, kBallCenter, 0.998 * kBallRadius, {}, {}};
    for (int s = 0; s < kSubsteps; ++s) {
      for (const std::uint32_t p : held_) {
        Vec3 at = cloth_.positions()[p];
        const double apart = 2 * torn_ > size_.rows ? 0.4 * kFrameSeconds / kSubsteps : 0;
        at.x = std::clamp(at.x + (at.x < 0 ? -apart : apart), -kFarthest, kFarthest);
        at.z = std::max(at.z - 0.25 * kFrameSeconds / kSubsteps, kHeight - 0.4);
        cloth_.move_pinned(p, at);
      }
      cloth_.substep(kFrameSeconds / kSubsteps, std::span(&ball, 1));
    }
    std::copy(cloth_.positions().begin(), cloth_.positions().end(), positions_.begin());
  }

 private:
  Size size_;
  Cloth cloth_;
  std::vector<std::uint32_t> held_;
  int frame_ = 0;
  int torn_ = 0;  // rows
};

}  // namespace

std::unique_ptr<Model> make_torn(std::uint32_t triangles) {
  return std::make_unique<Torn>(Size(triangles));
}

}  // namespace warmfront::client::scenes
