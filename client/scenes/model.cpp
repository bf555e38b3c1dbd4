// SPDX-License-Identifier: Apache-2.0
// Shapes and rigid placement: see model.h.
#include "client/scenes/model.h"

#include <algorithm>
#include <map>
#include <utility>

namespace warmfront::client::scenes {

void Shapes::add_grid(int rows, int columns, bool wrap_rows, bool wrap_columns,
                      const std::function<Vec3(int, int)>& place) {
  const auto base = static_cast<std::int32_t>(vertices.size());
  const int point_rows = wrap_rows ? rows : rows + 1;
  const int point_columns = wrap_columns ? columns : columns + 1;
  for (int r = 0; r < point_rows; ++r)
    for (int c = 0; c < point_columns; ++c) vertices.push_back(place(r, c));
  const auto at = [&](int r, int c) { return base + (r % point_rows) * point_columns + c % point_columns; };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      scene.faces.push_back({at(r, c), at(r, c + 1), at(r + 1, c + 1)});
      scene.faces.push_back({at(r, c), at(r + 1, c + 1), at(r + 1, c)});
    }
}

void Shapes::add_cube(int n, const std::function<Vec3(Vec3)>& place) {
  std::map<std::array<int, 3>, std::int32_t> index;
  const auto at = [&](const std::array<int, 3>& p) {
    const auto [found, fresh] = index.try_emplace(p, static_cast<std::int32_t>(vertices.size()));
    if (fresh) vertices.push_back(place({2.0 * p[0] / n - 1, 2.0 * p[1] / n - 1, 2.0 * p[2] / n - 1}));
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int u, int v) {
            std::array<int, 3> p{};
            p[axis] = side;
            p[(axis + 1) % 3] = u;
            p[(axis + 2) % 3] = v;
            return at(p);
          };
          std::array<std::int32_t, 4> quad{corner(i, j), corner(i + 1, j), corner(i + 1, j + 1),
                                           corner(i, j + 1)};
          if (side == 0) std::swap(quad[1], quad[3]);  // outwards
          scene.faces.push_back({quad[0], quad[1], quad[2]});
          scene.faces.push_back({quad[0], quad[2], quad[3]});
        }
}

void Shapes::add_box(int n, Vec3 center, Vec3 half_size) {
  add_cube(n, [&](Vec3 p) { return center + Vec3{half_size.x * p.x, half_size.y * p.y, half_size.z * p.z}; });
}

void Shapes::add_sphere(int n, Vec3 center, double radius) {
  add_cube(n, [&](Vec3 p) { return center + (radius / norm(p)) * p; });
}

void Shapes::add_capsule(int n, Vec3 center, double radius, double half_length) {
  add_cube(n, [&](Vec3 p) {
    const double shift = p.z > 0 ? half_length : p.z < 0 ? -half_length : 0;
    return center + (radius / norm(p)) * p + Vec3{0, 0, shift};
  });
}

void Shapes::end_body(std::string name, BodyKind kind) {
  const std::uint32_t first = scene.vertex_count;
  scene.vertex_count = static_cast<std::uint32_t>(vertices.size());
  scene.bodies.push_back({std::move(name), first, scene.vertex_count - first, kind});
}

void Shapes::add_half_space(std::string name, const HalfSpace& half_space) {
  Body body{std::move(name), static_cast<std::uint32_t>(vertices.size()), 0, BodyKind::kStatic};
  body.half_space = half_space;
  scene.bodies.push_back(std::move(body));
}

int rounded_root(double square, int least) {
  return std::max(least, static_cast<int>(std::floor(std::sqrt(std::max(0.0, square)) + 0.5)));
}

int cube_cells(double triangles, int least) {
  return rounded_root(triangles / 12, least);
}

void Model::place(std::size_t index, const Pose& pose) {
  const Body& body = shapes_.scene.bodies[index];
  for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v)
    positions_[v] = pose.apply(shapes_.vertices[v]);
}

}  // namespace warmfront::client::scenes
