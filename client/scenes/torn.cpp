// SPDX-License-Identifier: Apache-2.0
// A cloth that is held on two sides is drawn down over a ball and torn along its middle, from one side to the
// other; its halves are drawn off. The vertices of the seam are there twice, a little apart, and come apart
// as it tears: the topology stays. Or, as `cut`, they are one until it tears, and two from then on: the
// topology changes with each frame in which it does. Thread safety as in model.h.
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
  /// Rows of the seam, of rows + 1, that are torn at a frame.
  int torn_at(int frame) const {
    return std::clamp((rows + 1) * (frame - kFirstTorn) / (kLastTorn - kFirstTorn), 0, rows + 1);
  }
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

class Torn : public Model {
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
    for (const int torn = size_.torn_at(frame_); torn_ < torn; ++torn_)
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

 protected:
  const Size& size() const { return size_; }

 private:
  Size size_;
  Cloth cloth_;
  std::vector<std::uint32_t> held_;
  int frame_ = 0;
  int torn_ = 0;  // rows
};

/// Of each pair of the seam that is not torn yet, only the first vertex is there, in the middle of both.
class Cut final : public Torn {
 public:
  explicit Cut(const Size& size) : Torn(size) {
    for (int frame = 1; frame <= kLastTorn; ++frame)
      if (size.torn_at(frame) > size.torn_at(frame - 1))
        changes_.push_back(static_cast<std::uint32_t>(frame));
  }

  std::vector<std::uint32_t> changes() const override { return changes_; }

  SceneDescription scene_of(std::size_t part) const override {
    const std::vector<std::int32_t> numbers = numbers_in(part);
    SceneDescription changed = scene();
    for (auto& face : changed.faces)
      for (std::int32_t& v : face) v = numbers[static_cast<std::size_t>(v)];
    std::uint32_t& vertices = changed.bodies[0].vertex_count;
    const auto joined = static_cast<std::uint32_t>(size().rows + 1 - torn_in(part));
    vertices -= joined;
    changed.bodies[1].first_vertex = vertices;
    changed.vertex_count -= joined;
    return changed;
  }

  std::vector<Vec3> positions_of(std::size_t part) const override {
    std::vector<Vec3> placed;
    for (std::uint32_t v = 0; v < positions_.size(); ++v)
      if (!is_joined(v, part)) placed.push_back(positions_[v]);
    for (int r = torn_in(part); r <= size().rows; ++r) {
      const std::uint32_t left = size().vertex(0, r, size().columns);
      placed[left] = 0.5 * (positions_[left] + positions_[size().vertex(1, r, 0)]);
    }
    return placed;
  }

 private:
  int torn_in(std::size_t part) const {
    return part == 0 ? 0 : size().torn_at(static_cast<int>(changes_[part - 1]));
  }
  /// Whether `v` is the second vertex of a pair that is one.
  bool is_joined(std::uint32_t v, std::size_t part) const {
    const std::uint32_t second_half = size().vertex(1, 0, 0), columns = size().vertex(0, 1, 0);
    return v >= size().vertex(1, torn_in(part), 0) && v <= size().vertex(1, size().rows, 0) &&
           (v - second_half) % columns == 0;
  }
  /// Of each vertex of the model.
  std::vector<std::int32_t> numbers_in(std::size_t part) const {
    std::vector<std::int32_t> numbers;
    std::int32_t next = 0;
    for (std::uint32_t v = 0; v < positions_.size(); ++v) numbers.push_back(is_joined(v, part) ? -1 : next++);
    for (int r = torn_in(part); r <= size().rows; ++r)
      numbers[size().vertex(1, r, 0)] = numbers[size().vertex(0, r, size().columns)];
    return numbers;
  }

  std::vector<std::uint32_t> changes_;
};

}  // namespace

std::unique_ptr<Model> make_cut(std::uint32_t triangles) {
  return std::make_unique<Cut>(Size(triangles));
}

std::unique_ptr<Model> make_torn(std::uint32_t triangles) {
  return std::make_unique<Torn>(Size(triangles));
}

}  // namespace warmfront::client::scenes
