// SPDX-License-Identifier: Apache-2.0
// Look-alikes of flamenco (three skirts round a twirling waist and kicking legs) and princess (a long dress
// and an overskirt on a body that turns to and fro). Both are layers of tubes of cloth pinned to a ring that
// turns with a body of spheres and capsules. Thread safety as in model.h.
#include <algorithm>
#include <utility>

#include "client/scenes/cloth.h"
#include "client/scenes/model.h"

namespace warmfront::client::scenes {
namespace {

constexpr int kSubsteps = 8;

/// A tube of cloth from a ring at the waist down to a hem.
struct Layer {
  const char* name;
  double waist_radius, waist_height;
  double hem_radius, hem_height;
};

/// A part of the body: a sphere or an upright capsule, which may kick about its upper end.
struct Limb {
  const char* name;
  Vec3 top;
  double radius, length;
  double kick;   ///< largest angle, radians
  double phase;  ///< of its kick, turns
};

/// How the whole body moves: turns about z, and sways.
struct Dance {
  double (*angle)(double time);
  double sway;
};

struct Figure {
  std::vector<Layer> layers;
  std::vector<Limb> limbs;
  Dance dance;
};

/// The cells of a layer and of a limb.
struct Size {
  Size(const Figure& figure, std::uint32_t triangles) {
    const auto limbs = static_cast<double>(figure.limbs.size());
    limb = cube_cells(0.08 * triangles / limbs, 3);
    const double layer = (triangles - limbs * 12 * limb * limb) / static_cast<double>(figure.layers.size());
    // Cells about as wide as high on a tube some 3.5 times as long round as down.
    rows = rounded_root(layer / 7, 4);
    columns = std::max(8, static_cast<int>(layer / (2 * rows) + 0.5));
  }
  int limb;
  int rows;
  int columns;
};

Shapes make_shapes(const Figure& figure, Size size) {
  Shapes shapes;
  for (const Layer& layer : figure.layers) {
    shapes.add_grid(size.rows, size.columns, false, true, [&](int r, int c) {
      const double down = static_cast<double>(r) / size.rows;
      const auto [s, cosine] = sin_cos(2 * kPi * c / size.columns);
      // Folds, deeper towards the hem.
      const double fold = 1 + 0.06 * down * sin_cos(2 * kPi * 12 * c / size.columns).sin;
      const double radius = fold * (layer.waist_radius + down * (layer.hem_radius - layer.waist_radius));
      return Vec3{radius * cosine, radius * s,
                  layer.waist_height + down * (layer.hem_height - layer.waist_height)};
    });
    shapes.end_body(layer.name, BodyKind::kDeformable);
  }
  for (const Limb& limb : figure.limbs) {
    // At rest its upper end is the origin, so that a pose turns it about that.
    shapes.add_capsule(size.limb, {0, 0, -limb.length / 2}, limb.radius, limb.length / 2);
    shapes.end_body(limb.name, BodyKind::kRigid);
  }
  return shapes;
}

/// `second` after `first`.
Pose compose(const Pose& second, const Pose& first) {
  const Vec3 x = second.rotate(first.rotate({1, 0, 0}));
  const Vec3 y = second.rotate(first.rotate({0, 1, 0}));
  const Vec3 z = second.rotate(first.rotate({0, 0, 1}));
  return {{Vec3{x.x, y.x, z.x}, Vec3{x.y, y.y, z.y}, Vec3{x.z, y.z, z.z}}, second.apply(first.origin)};
}

class Dancer final : public Model {
 public:
  Dancer(Figure figure, Size size)
      : Model(make_shapes(figure, size)), figure_(std::move(figure)), size_(size), cloth_(cloth_vertices()) {
    std::uint32_t first = 0;
    for (std::size_t i = 0; i < figure_.layers.size(); ++i) {
      cloth_.link_grid(first, size.rows, size.columns, true);
      for (int c = 0; c < size.columns; ++c) cloth_.pin(first + static_cast<std::uint32_t>(c));
      first += scene().bodies[i].vertex_count;
    }
    const Layer& layer = figure_.layers.front();
    cell_ = std::abs(layer.waist_height - layer.hem_height) / size.rows;
    place_limbs();
  }

  void advance() override {
    cloth_.find_neighbours(0.5 * cell_);
    const double seconds = kFrameSeconds / kSubsteps;
    for (int s = 0; s < kSubsteps; ++s) {
      const Pose before = body_pose(time_);
      time_ += seconds;
      const Pose after = body_pose(time_);
      move_waists(after);
      const double spin = (figure_.dance.angle(time_) - figure_.dance.angle(time_ - seconds)) / seconds;
      std::vector<Obstacle> obstacles;
      for (const Limb& limb : figure_.limbs) {
        const Pose pose = compose(after, limb_pose(limb, time_));
        const Vec3 top = pose.origin;
        const Vec3 was = compose(before, limb_pose(limb, time_ - seconds)).origin;
        obstacles.push_back({top,
                             pose.apply({0, 0, -limb.length}),
                             0.998 * limb.radius,
                             (1 / seconds) * (top - was),
                             {0, 0, spin}});
      }
      cloth_.substep(seconds, obstacles);
    }
    std::copy(cloth_.positions().begin(), cloth_.positions().end(), positions_.begin());
    place_limbs();
  }

 private:
  std::span<const Vec3> cloth_vertices() const {
    return std::span(shapes_.vertices).first(scene().bodies[figure_.layers.size()].first_vertex);
  }

  Pose body_pose(double time) const {
    const auto [s, c] = sin_cos(2 * kPi * 0.7 * time);
    return turned({0, 0, 1}, figure_.dance.angle(time), figure_.dance.sway * Vec3{s, 1 - c, 0});
  }

  static Pose limb_pose(const Limb& limb, double time) {
    const double swing = sin_cos(2 * kPi * (1.1 * time + limb.phase)).sin - sin_cos(2 * kPi * limb.phase).sin;
    // Eased in over the first half second.
    return turned({0, 1, 0}, -limb.kick * std::min(1.0, 2 * time) * swing, limb.top);
  }

  void move_waists(const Pose& pose) {
    for (std::size_t i = 0; i < figure_.layers.size(); ++i) {
      const std::uint32_t first = scene().bodies[i].first_vertex;
      for (int c = 0; c < size_.columns; ++c) {
        const std::uint32_t p = first + static_cast<std::uint32_t>(c);
        cloth_.move_pinned(p, pose.apply(shapes_.vertices[p]));
      }
    }
  }

  void place_limbs() {
    for (std::size_t i = 0; i < figure_.limbs.size(); ++i)
      place(figure_.layers.size() + i, compose(body_pose(time_), limb_pose(figure_.limbs[i], time_)));
  }

  Figure figure_;
  Size size_;
  Cloth cloth_;
  double cell_ = 0;
  double time_ = 0;
};

std::unique_ptr<Model> make_dancer(Figure figure, std::uint32_t triangles) {
  const Size size(figure, triangles);
  return std::make_unique<Dancer>(std::move(figure), size);
}

// Faster and faster for a second, then steady.
double twirl(double time) {
  return time < 1 ? 3 * time * time : 6 * time - 3;
}

// To and fro, from rest.
double turn_to_and_fro(double time) {
  return 0.8 * (1 - sin_cos(2 * kPi * 0.5 * time).cos);
}

}  // namespace

std::unique_ptr<Model> make_flamenco(std::uint32_t triangles) {
  return make_dancer({{{"skirt_inner", 0.150, 1.00, 0.52, 0.35},
                       {"skirt_middle", 0.165, 1.01, 0.56, 0.45},
                       {"skirt_outer", 0.180, 1.02, 0.60, 0.55}},
                      {{"pelvis", {0, 0, 0.93}, 0.145, 0.0, 0, 0},
                       {"leg_left", {0, 0.075, 0.70}, 0.07, 0.62, 0.7, 0.0},
                       {"leg_right", {0, -0.075, 0.70}, 0.07, 0.62, 0.7, 0.5}},
                      {twirl, 0.05}},
                     triangles);
}

std::unique_ptr<Model> make_princess(std::uint32_t triangles) {
  return make_dancer({{{"dress", 0.155, 1.05, 0.60, 0.04}, {"overskirt", 0.175, 1.06, 0.50, 0.50}},
                      {{"torso", {0, 0, 1.45}, 0.14, 0.17, 0, 0},
                       {"hips", {0, 0, 0.93}, 0.17, 0.0, 0, 0},
                       {"head", {0, 0, 1.75}, 0.11, 0.0, 0, 0},
                       {"leg_left", {0, 0.08, 0.66}, 0.075, 0.52, 0.25, 0.0},
                       {"leg_right", {0, -0.08, 0.66}, 0.075, 0.52, 0.25, 0.5}},
                      {turn_to_and_fro, 0.03}},
                     triangles);
}

}  // namespace warmfront::client::scenes
