// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/scene.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace warmfront {
namespace {

Status check_faces(const SceneDescription& description) {
  const auto n = static_cast<std::int64_t>(description.vertex_count);
  for (std::size_t f = 0; f < description.faces.size(); ++f) {
    const auto& face = description.faces[f];
    for (int corner = 0; corner < 3; ++corner) {
      if (face[corner] < 0 || face[corner] >= n) {
        return invalid_argument("faces[" + std::to_string(f) + "][" + std::to_string(corner) +
                                "]: vertex index " + std::to_string(face[corner]) + " is not in [0, " +
                                std::to_string(n) + ")");
      }
    }
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      const int repeated = (face[0] == face[1] || face[0] == face[2]) ? face[0] : face[1];
      return invalid_argument("faces[" + std::to_string(f) + "]: vertex index " + std::to_string(repeated) +
                              " is repeated; remove the face");
    }
  }
  return {};
}

Status check_bodies(const SceneDescription& description) {
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    const Body& body = description.bodies[i];
    const std::string where = "bodies[" + std::to_string(i) + "]";
    if (body.vertex_count == 0) return invalid_argument(where + ".vertex_count: is 0; remove the body");
    if (body.first_vertex != next) {
      return invalid_argument(where + ".first_vertex: is " + std::to_string(body.first_vertex) + " where " +
                              std::to_string(next) +
                              " is expected; bodies must cover all vertices in order, without " +
                              (body.first_vertex < next ? "overlap" : "gap"));
    }
    next += body.vertex_count;
    if (next > description.vertex_count) {
      return invalid_argument(where + ".vertex_count: ends at vertex " + std::to_string(next) + " of " +
                              std::to_string(description.vertex_count));
    }
  }
  if (!description.bodies.empty() && next != description.vertex_count) {
    return invalid_argument("bodies: cover " + std::to_string(next) + " of " +
                            std::to_string(description.vertex_count) + " vertices; add a body for the rest");
  }
  return {};
}

// Rows of the items that mention each key; items stay ascending in a row.
template <std::size_t K>
Csr invert(std::span<const std::array<std::uint32_t, K>> lists, std::size_t rows) {
  Csr csr;
  csr.begin.assign(rows + 1, 0);
  for (const auto& list : lists) {
    for (const std::uint32_t key : list) ++csr.begin[key + 1];
  }
  std::partial_sum(csr.begin.begin(), csr.begin.end(), csr.begin.begin());
  csr.items.resize(csr.begin.back());
  std::vector<std::uint32_t> cursor(csr.begin.begin(), csr.begin.end() - 1);
  for (std::size_t i = 0; i < lists.size(); ++i) {
    for (const std::uint32_t key : lists[i]) csr.items[cursor[key]++] = static_cast<std::uint32_t>(i);
  }
  return csr;
}

struct EdgeTable {
  std::vector<Edge> edges;
  std::vector<std::array<std::uint32_t, 3>> face_edges;
};

EdgeTable find_edges(std::span<const Face> faces) {
  struct Side {
    Edge edge;
    std::uint32_t face_side;  // 3 * face + side
  };
  std::vector<Side> sides;
  sides.reserve(faces.size() * 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = faces[f][side];
      const std::uint32_t to = faces[f][(side + 1) % 3];
      sides.push_back({{std::min(from, to), std::max(from, to)}, static_cast<std::uint32_t>(3 * f + side)});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.edge, x.face_side) < std::tie(y.edge, y.face_side);
  });
  EdgeTable table;
  table.face_edges.resize(faces.size());
  for (const Side& side : sides) {
    if (table.edges.empty() || table.edges.back() != side.edge) table.edges.push_back(side.edge);
    table.face_edges[side.face_side / 3][side.face_side % 3] =
        static_cast<std::uint32_t>(table.edges.size() - 1);
  }
  return table;
}

// Connected components of the faces (isolated vertices are components of their own), numbered by their least
// vertex.
std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::uint32_t vertex_count,
                                                std::uint32_t& count) {
  std::vector<std::uint32_t> root(vertex_count);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&root](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Face& face : faces) {
    for (int corner = 1; corner < 3; ++corner) {
      const std::uint32_t a = find(face[0]);
      const std::uint32_t b = find(face[corner]);
      root[std::max(a, b)] = std::min(a, b);  // a root is always the least vertex of its component
    }
  }
  std::vector<std::uint32_t> component(vertex_count);
  count = 0;
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    const std::uint32_t r = find(v);
    component[v] = r == v ? count++ : component[r];
  }
  return component;
}

}  // namespace

Result<Scene> Scene::create(SceneDescription description) {
  if (Status status = check_faces(description); !status) return status.error();
  if (Status status = check_bodies(description); !status) return status.error();
  // Primitive, side and node numbers are 32 bit.
  if (description.faces.size() + description.vertex_count > 0x3fffffff) {
    return invalid_argument("faces: " + std::to_string(description.faces.size()) + " and " +
                            std::to_string(description.vertex_count) +
                            " vertices are together more than 2^30 - 1");
  }

  Scene scene;
  scene.vertex_count_ = description.vertex_count;
  scene.faces_.reserve(description.faces.size());
  for (const auto& face : description.faces) {
    scene.faces_.push_back({static_cast<std::uint32_t>(face[0]), static_cast<std::uint32_t>(face[1]),
                            static_cast<std::uint32_t>(face[2])});
  }
  EdgeTable table = find_edges(scene.faces_);
  scene.edges_ = std::move(table.edges);
  scene.face_edges_ = std::move(table.face_edges);
  scene.vertex_faces_ = invert<3>(scene.faces_, scene.vertex_count_);
  scene.edge_faces_ = invert<3>(scene.face_edges_, scene.edges_.size());
  for (std::uint32_t v = 0; v < scene.vertex_count_; ++v) {
    if (scene.vertex_faces_[v].empty()) scene.isolated_vertices_.push_back(v);
  }
  scene.bodies_ = std::move(description.bodies);
  if (scene.bodies_.empty()) {
    scene.body_of_vertex_ = connected_components(scene.faces_, scene.vertex_count_, scene.body_count_);
  } else {
    scene.body_count_ = static_cast<std::uint32_t>(scene.bodies_.size());
    scene.body_of_vertex_.reserve(scene.vertex_count_);
    for (std::uint32_t b = 0; b < scene.body_count_; ++b) {
      scene.body_of_vertex_.insert(scene.body_of_vertex_.end(), scene.bodies_[b].vertex_count, b);
    }
  }
  return scene;
}

std::array<std::uint32_t, 4> Scene::vertices_of(const Contact& contact) const {
  if (contact.kind == ContactKind::kVertexFace) {
    const Face& face = faces_[contact.b];
    return {contact.a, face[0], face[1], face[2]};
  }
  const Edge& a = edges_[contact.a];
  const Edge& b = edges_[contact.b];
  return {a[0], a[1], b[0], b[1]};
}

std::size_t Scene::memory_bytes() const {
  return faces_.size() * sizeof(Face) + edges_.size() * sizeof(Edge) +
         face_edges_.size() * sizeof(face_edges_[0]) + vertex_faces_.memory_bytes() +
         edge_faces_.memory_bytes() +
         (isolated_vertices_.size() + body_of_vertex_.size()) * sizeof(std::uint32_t) +
         bodies_.size() * sizeof(Body);
}

}  // namespace warmfront
