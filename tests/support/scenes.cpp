// SPDX-License-Identifier: Apache-2.0
#include "tests/support/scenes.h"

#include <stdexcept>
#include <utility>

#include "tests/support/draws.h"

namespace warmfront::testing {
namespace {

double uniform(std::mt19937_64& random, double lo, double hi) {
  return lo + (hi - lo) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

}  // namespace

std::shared_ptr<const Scene> make_scene(std::uint32_t vertex_count, Faces faces, Edges edges) {
  SceneDescription description;
  description.vertex_count = vertex_count;
  description.faces = std::move(faces);
  description.edges = std::move(edges);
  auto scene = Scene::create(std::move(description));
  if (!scene) throw std::runtime_error(scene.error().message);
  return std::make_shared<const Scene>(std::move(scene).value());
}

void append_elements(const Scene& scene, std::uint32_t first, Faces& faces, Edges& edges) {
  const auto moved = [first](std::uint32_t v) { return static_cast<std::int32_t>(v + first); };
  for (const Face& face : scene.faces()) faces.push_back({moved(face[0]), moved(face[1]), moved(face[2])});
  for (const std::uint32_t e : scene.lone_edges())
    edges.push_back({moved(scene.edges()[e][0]), moved(scene.edges()[e][1])});
}

Faces tetrahedron() {
  return {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
}

Faces octahedron() {
  return {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
}

Faces grid(int n) {
  Faces faces;
  const auto at = [n](int i, int j) { return i * (n + 1) + j; };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return faces;
}

RandomScene random_scene(std::mt19937_64& random) {
  Faces faces;
  std::vector<double> positions;
  const auto vertex_count = [&] { return static_cast<int>(positions.size() / 3); };
  const auto add = [&](const Faces& part, int vertices, double size) {
    const int first = vertex_count();
    const double at[3] = {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    for (int i = 0; i < 3 * vertices; ++i) positions.push_back(at[i % 3] + uniform(random, -size, size));
    for (const auto& f : part) faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  };
  const int parts = 1 + below(random, 3);
  for (int i = 0; i < parts; ++i) {
    const double size = uniform(random, 0.2, 1.2);
    switch (below(random, 4)) {
      case 0:
        add(tetrahedron(), 4, size);
        break;
      case 1:
        add(octahedron(), 6, size);
        break;
      case 2: {
        const int n = 1 + below(random, 3);
        const int first = vertex_count();
        add(grid(n), (n + 1) * (n + 1), 0.05);
        for (int a = 0; a <= n; ++a) {
          for (int b = 0; b <= n; ++b) {
            positions[3 * (first + a * (n + 1) + b)] += size * a / n;
            positions[3 * (first + a * (n + 1) + b) + 1] += size * b / n;
          }
        }
        break;
      }
      default:
        add({{0, 1, 2}}, 3, size);
        break;
    }
  }
  // Oddities, over the vertices that are there: fins, bow-ties, chords, duplicates, flips, segments, points.
  for (int i = below(random, 4); i > 0; --i) {
    const int n = vertex_count();
    faces.push_back({below(random, n), below(random, n), below(random, n)});
    if (below(random, 4) == 0) faces.back()[below(random, 3)] = faces.back()[below(random, 3)];
    if (below(random, 16) == 0) faces.back().fill(faces.back()[0]);
  }
  if (below(random, 3) == 0) {
    auto copy = faces[below(random, static_cast<int>(faces.size()))];
    if (below(random, 2) == 0) std::swap(copy[0], copy[1]);
    faces.push_back(copy);
  }
  for (int i = below(random, 3); i > 0; --i) add({}, 1, 0.5);
  // Strands of edges, free or rooted on what is there, and chords, some of which are sides of faces.
  Edges edges;
  for (int strands = below(random, 4); strands > 0; --strands) {
    const int first = vertex_count();
    const int segments = 1 + below(random, 5);
    add({}, segments + below(random, 2), 0.6);
    int from = below(random, 2) == 0 ? below(random, first) : first;
    for (int to = from == first ? first + 1 : first; to < vertex_count(); ++to) {
      edges.push_back({from, to});
      if (below(random, 4) != 0) from = to;
    }
  }
  for (int i = below(random, 4); i > 0; --i) {
    const int a = below(random, vertex_count()), b = below(random, vertex_count());
    if (a != b) edges.push_back({a, b});
  }
  // Coincident and collinear vertices make degenerate faces and edges.
  if (below(random, 4) == 0) {
    const int n = vertex_count();
    const int from = below(random, n);
    const int to = below(random, n);
    for (int axis = 0; axis < 3; ++axis) positions[3 * to + axis] = positions[3 * from + axis];
  }
  return {make_scene(static_cast<std::uint32_t>(vertex_count()), faces, edges), positions};
}

std::vector<double> random_motion(std::mt19937_64& random, const Scene& scene,
                                  const std::vector<double>& positions) {
  std::vector<double> moved = positions;
  const double step = below(random, 5) == 0 ? 2.0 : uniform(random, 0.0, 0.3);
  std::vector<std::array<double, 3>> drift(scene.body_count());
  std::vector<bool> rests(scene.body_count());
  for (std::uint32_t body = 0; body < scene.body_count(); ++body) {
    for (double& d : drift[body]) d = uniform(random, -step, step);
    rests[body] = below(random, 4) == 0;
  }
  for (std::uint32_t v = 0; v < scene.vertex_count(); ++v) {
    const std::uint32_t body = scene.body_of_vertex()[v];
    if (rests[body]) continue;
    for (int axis = 0; axis < 3; ++axis) {
      moved[3 * v + axis] += drift[body][axis] + uniform(random, -step / 4, step / 4);
    }
  }
  return moved;
}

}  // namespace warmfront::testing
