// SPDX-License-Identifier: Apache-2.0
// Scenes that fill hierarchies and fronts of many chunks, with edges near 1.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/support/accepted_state.h"
#include "tests/support/accepted_state_parts.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

// What is drawn for it is of this size: else nearly all would touch, and take long to test.
constexpr double kUnit = 0.25;

class LargeScene {
 public:
  explicit LargeScene(Draws& draws) : draws_(draws), may_turn_(draws.below(2) == 0) {}

  // Sheets above each other, some so near that they touch at once.
  void add_layers() {
    const int side = 6 + draws_.below(12), layers = 2 + draws_.below(3);
    const double gap = std::ldexp(1, -draws_.below(5));
    for (int layer = 0; layer < layers; ++layer) {
      add_sheet(side, [&](double i, double j) {
        return std::array{i, j + 0.3 * layer, gap * layer + 0.2 * gap * std::sin(0.7 * i + layer)};
      });
    }
  }
  // A sheet rolled up, whose windings are near each other.
  void add_roll() {
    const double pitch = std::ldexp(1, -draws_.below(4));
    add_sheet(10 + draws_.below(16), [&](double i, double j) {
      const double angle = std::sqrt(4 * 3.14159 * i / pitch), radius = pitch * angle / 6.28318;
      return std::array{radius * std::cos(angle), radius * std::sin(angle), j};
    });
  }
  void add_crowd() {
    const int bodies = 20 + draws_.below(80);
    const double size = std::cbrt(bodies) * (1 + draws_.below(2));
    for (int b = 0; b < bodies; ++b) {
      Shape shape = draw_shape(draws_);
      const double at[3] = {draws_.uniform(size), draws_.uniform(size), draws_.uniform(size)};
      for (std::size_t i = 0; i < shape.positions.size(); ++i) shape.positions[i] += at[i % 3];
      add(draw_body(draws_, shape.positions.size() / 3, kUnit, may_turn_), shape.faces, shape.edges,
          shape.positions);
    }
  }
  void add_half_space() {
    Body body = draw_half_space(draws_, kUnit, 0);
    body.first_vertex = scene_.vertex_count;
    scene_.bodies.push_back(body);
  }

  AcceptedState made(bool declares_bodies) {
    if (!declares_bodies) scene_.bodies.clear();
    AcceptedState state(std::move(scene_), std::move(positions_));
    state.may_turn = may_turn_;
    state.unit = kUnit;
    return state;
  }

 private:
  template <class At>
  void add_sheet(int side, At&& at) {
    std::vector<double> positions;
    for (int i = 0; i <= side; ++i) {
      for (int j = 0; j <= side; ++j) {
        for (const double x : at(i, j)) positions.push_back(x + draws_.uniform(0.01));
      }
    }
    Body body = draw_body(draws_, positions.size() / 3, kUnit, may_turn_);
    if (draws_.below(3) != 0) {
      body.kind = BodyKind::kDeformable;
      body.screw = false;
    }
    add(body, grid(side), {}, positions);
  }
  void add(Body body, const Faces& faces, const Edges& edges, const std::vector<double>& positions) {
    body.first_vertex = scene_.vertex_count;
    append(faces, edges, scene_);
    scene_.vertex_count += body.vertex_count;
    scene_.bodies.push_back(body);
    positions_.insert(positions_.end(), positions.begin(), positions.end());
  }

  Draws& draws_;
  const bool may_turn_;
  SceneDescription scene_;
  std::vector<double> positions_;
};

}  // namespace

AcceptedState draw_large_state(Draws& draws) {
  LargeScene scene(draws);
  const bool crowd = draws.below(2) == 0;
  if (crowd)
    scene.add_crowd();
  else if (draws.below(2) == 0)
    scene.add_layers();
  else
    scene.add_roll();
  const bool has_half_space = draws.below(4) == 0;
  if (has_half_space) scene.add_half_space();
  return scene.made(crowd || has_half_space || draws.below(3) != 0);
}

}  // namespace warmfront::testing
