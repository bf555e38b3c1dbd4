// SPDX-License-Identifier: Apache-2.0
// A moving scene: its shapes and their positions. A model is used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/scenes/math.h"
#include "engine/scene.h"

namespace warmfront::client::scenes {

inline constexpr double kFrameSeconds = 1.0 / 30;

/// Appends shapes; a body is what was appended between two calls of end_body().
class Shapes {
 public:
  /// A grid of `rows` x `columns` cells, two triangles each, whose corners are at `place(row, column)`;
  /// columns wrap round (a tube) and so do rows (a torus) when asked.
  void add_grid(int rows, int columns, bool wrap_rows, bool wrap_columns,
                const std::function<Vec3(int, int)>& place);

  /// A cube's surface with n x n cells a side, so 12 n^2 triangles and 6 n^2 + 2 vertices; `place` maps [-1,
  /// 1]^3 there.
  void add_cube(int n, const std::function<Vec3(Vec3)>& place);
  /// The cube mapped to a box, to a sphere, and to a capsule along z (half the length between its centres).
  void add_box(int n, Vec3 center, Vec3 half_size);
  void add_sphere(int n, Vec3 center, double radius);
  void add_capsule(int n, Vec3 center, double radius, double half_length);

  void end_body(std::string name, BodyKind kind);
  /// A static body of its own.
  void add_half_space(std::string name, const HalfSpace& half_space);

  std::vector<Vec3> vertices;
  SceneDescription scene;
};

/// The n for which a cube (or sphere) has about `triangles` triangles; at least `least`.
int cube_cells(double triangles, int least);
/// The nearest whole number to the square root, at least `least`.
int rounded_root(double square, int least);

/// How triangles are shared out between a square cloth and a ball that it falls on: cells along a side of each.
struct ClothOverBall {
  explicit ClothOverBall(std::uint32_t triangles)
      : ball(cube_cells(0.06 * triangles, 4)), cloth(rounded_root((triangles - 12.0 * ball * ball) / 2, 4)) {}
  int ball;
  int cloth;
};

/// Frame after frame of a scene.
class Model {
 public:
  virtual ~Model() = default;

  const SceneDescription& scene() const { return shapes_.scene; }
  std::span<const Vec3> positions() const { return positions_; }

  /// Moves on by kFrameSeconds.
  virtual void advance() = 0;

  /// Of a model whose topology changes: the frames at which it does, ascending and above 0; its scene between
  /// two of them; and where the vertices of that scene are now.
  virtual std::vector<std::uint32_t> changes() const { return {}; }
  virtual SceneDescription scene_of(std::size_t /*part*/) const { return scene(); }
  virtual std::vector<Vec3> positions_of(std::size_t /*part*/) const { return positions_; }

 protected:
  explicit Model(Shapes shapes) : shapes_(std::move(shapes)), positions_(shapes_.vertices) {}

  /// Places body `index` of the scene at `pose` of its reference shape.
  void place(std::size_t index, const Pose& pose);

  Shapes shapes_;
  std::vector<Vec3> positions_;
};

/// The built-in models, each with about `triangles` triangles.
std::unique_ptr<Model> make_cloth_ball(std::uint32_t triangles);
std::unique_ptr<Model> make_flamenco(std::uint32_t triangles);
std::unique_ptr<Model> make_n_body(std::uint32_t triangles);
std::unique_ptr<Model> make_princess(std::uint32_t triangles);
std::unique_ptr<Model> make_bart(std::uint32_t triangles);
std::unique_ptr<Model> make_particles(std::uint32_t triangles);
std::unique_ptr<Model> make_ground(std::uint32_t triangles);
std::unique_ptr<Model> make_torn(std::uint32_t triangles);
std::unique_ptr<Model> make_cut(std::uint32_t triangles);
std::unique_ptr<Model> make_turning(std::uint32_t triangles);
std::unique_ptr<Model> make_hair(std::uint32_t elements);  ///< edges, and a few triangles

}  // namespace warmfront::client::scenes
