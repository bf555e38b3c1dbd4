// SPDX-License-Identifier: Apache-2.0
// A rippling cloth over a ball, at any place between its vertices, and the same in tiles that are a body
// each.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/scene.h"
#include "tests/support/cloth_over_ball.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {

/// What remesh_bench is told.
struct RemeshSettings {
  int side = 210;
  int tiles = 10;
  int frames = 30;
  int threads = 1;
  int changes = 10'000;
};

inline std::span<const double> doubles(const std::vector<double>& values) {
  return values;
}

// A cloth's frames, at any place between its vertices; as slow as a simulation's.
class Cloth {
 public:
  Cloth(int side, int frames) : side_(side), over_ball_(cloth_over_ball(side, frames / kSlower + 2)) {
    std::vector<std::vector<double>> slow;
    for (int f = 0; f < frames; ++f) {
      const std::vector<double>& from = over_ball_.frames[static_cast<std::size_t>(f / kSlower)];
      const std::vector<double>& to = over_ball_.frames[static_cast<std::size_t>(f / kSlower + 1)];
      const double share = static_cast<double>(f % kSlower) / kSlower;
      std::vector<double>& at = slow.emplace_back(from);
      for (std::size_t i = 0; i < at.size(); ++i) at[i] += share * (to[i] - from[i]);
    }
    over_ball_.frames = std::move(slow);
  }

  const ClothOverBall& over_ball() const { return over_ball_; }
  std::size_t cloth_vertices() const { return static_cast<std::size_t>(side_ + 1) * (side_ + 1); }

  // Tile (i, j) with quads x quads quads, a little apart from its neighbours.
  std::vector<double> tile(int frame, int i, int j, double width, int quads) const {
    constexpr double kApart = 0.3;
    std::vector<double> positions;
    for (int a = 0; a <= quads; ++a) {
      for (int b = 0; b <= quads; ++b) {
        const double u = i * width + kApart + (width - 2 * kApart) * a / quads;
        const double v = j * width + kApart + (width - 2 * kApart) * b / quads;
        for (int axis = 0; axis < 3; ++axis) positions.push_back(at(frame, u, v, axis));
      }
    }
    return positions;
  }

 private:
  static constexpr int kSlower = 32;

  double at(int frame, double u, double v, int axis) const {
    const int i = std::min(static_cast<int>(u), side_ - 1);
    const int j = std::min(static_cast<int>(v), side_ - 1);
    const auto x = [&](int row, int column) {
      return over_ball_.frames[static_cast<std::size_t>(frame)]
                              [static_cast<std::size_t>(3 * (row * (side_ + 1) + column) + axis)];
    };
    const double s = u - i, t = v - j;
    return (1 - s) * ((1 - t) * x(i, j) + t * x(i, j + 1)) +
           s * ((1 - t) * x(i + 1, j) + t * x(i + 1, j + 1));
  }

  int side_;
  ClothOverBall over_ball_;
};

inline BodyAddition sheet_of(int quads) {
  BodyAddition body;
  body.faces = grid(quads);
  body.body.vertex_count = static_cast<std::uint32_t>((quads + 1) * (quads + 1));
  return body;
}

// The scene of tiles, and the ball as the last body.
class Tiles {
 public:
  Tiles(const Cloth& cloth, const RemeshSettings& settings)
      : cloth_(cloth),
        count_(settings.tiles),
        width_(static_cast<double>(settings.side) / settings.tiles),
        quads_(static_cast<std::size_t>(count_) * count_, static_cast<int>(width_)) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(quads_.size()); }
  BodyAddition body(std::uint32_t tile) const { return sheet_of(quads_[tile]); }
  std::vector<double> positions_of(int frame, std::uint32_t tile) const {
    return cloth_.tile(frame, static_cast<int>(tile) / count_, static_cast<int>(tile) % count_, width_,
                       quads_[tile]);
  }
  // Another mesh, of about as many faces.
  void remesh(std::uint32_t tile) { quads_[tile] = static_cast<int>(width_) + (quads_[tile] + 2) % 3 - 1; }

  std::vector<double> positions(int frame) const {
    std::vector<double> all;
    const auto append = [&](auto first, auto last) { all.insert(all.end(), first, last); };
    for (std::uint32_t t = 0; t < count(); ++t) {
      const std::vector<double> of = positions_of(frame, t);
      append(of.begin(), of.end());
    }
    const std::vector<double>& whole = cloth_.over_ball().frames[static_cast<std::size_t>(frame)];
    append(whole.begin() + static_cast<std::ptrdiff_t>(3 * cloth_.cloth_vertices()), whole.end());
    return all;
  }
  SceneDescription scene() const {
    SceneDescription scene;
    const auto append = [&](const BodyAddition& body, std::int32_t less) {
      const auto first = static_cast<std::int32_t>(scene.vertex_count) - less;
      for (const auto& [a, b, c] : body.faces) scene.faces.push_back({a + first, b + first, c + first});
      scene.bodies.push_back(body.body);
      scene.bodies.back().first_vertex = scene.vertex_count;
      scene.vertex_count += body.body.vertex_count;
    };
    for (std::uint32_t t = 0; t < count(); ++t) append(body(t), 0);
    const SceneDescription& whole = cloth_.over_ball().description;
    const auto cloth_vertices = static_cast<std::int32_t>(cloth_.cloth_vertices());
    BodyAddition ball;
    for (const auto& face : whole.faces) {
      if (face[0] >= cloth_vertices) ball.faces.push_back(face);
    }
    ball.body.vertex_count = whole.vertex_count - static_cast<std::uint32_t>(cloth_vertices);
    append(ball, cloth_vertices);
    return scene;
  }

 private:
  const Cloth& cloth_;
  const int count_;
  const double width_;
  std::vector<int> quads_;
};

}  // namespace warmfront::testing
