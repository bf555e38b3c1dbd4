// SPDX-License-Identifier: Apache-2.0
#include "engine/scene.h"

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
  }
  return {};
}

// No pair can ever be in contact, and none can come to be.
bool could_never_touch(const SceneDescription& description) {
  return description.vertex_count > 0 && description.faces.empty() && description.bodies.empty();
}

std::string name_of(std::size_t body) {
  return "bodies[" + std::to_string(body) + "]";
}

// What a body says of itself, its range apart.
Status check_body(const Body& body, const std::string& where) {
  if (body.name.size() > kMaxNameBytes)
    return invalid_argument(where + ".name: is " + std::to_string(body.name.size()) +
                            " bytes long, and may be " + std::to_string(kMaxNameBytes));
  if (body.vertex_count == 0) return invalid_argument(where + ".vertex_count: is 0; remove the body");
  if (body.group == 0)
    return invalid_argument(where + ".group: is 0, so that no mask can hold it; set a bit (1 by default)");
  if (body.mask == 0)
    return invalid_argument(where +
                            ".mask: is 0, which excludes every body; set the bits of the groups to test "
                            "against, or leave the body out");
  return {};
}

Status check_bodies(const SceneDescription& description) {
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    const Body& body = description.bodies[i];
    const std::string where = name_of(i);
    if (Status status = check_body(body, where); !status) return status;
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
  for (std::size_t i = 0; i < description.excluded_pairs.size(); ++i) {
    const auto [a, b] = description.excluded_pairs[i];
    const std::string where = "excluded_pairs[" + std::to_string(i) + "]";
    if (std::max(a, b) >= description.bodies.size())
      return invalid_argument(where + ": body " + std::to_string(std::max(a, b)) + " is not in [0, " +
                              std::to_string(description.bodies.size()) + ")");
    if (a == b)
      return invalid_argument(where + ": body " + std::to_string(a) +
                              " with itself; switch its self_collision off instead");
  }
  return {};
}

Status check_faces_of_bodies(std::span<const Face> faces, std::span<const std::uint32_t> body_of_vertex) {
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t v : faces[f]) {
      const std::uint32_t body = body_of_vertex[faces[f][0]];
      if (body_of_vertex[v] != body)
        return invalid_argument("faces[" + std::to_string(f) + "]: joins " + name_of(body) + " and " +
                                name_of(body_of_vertex[v]) + "; a face lies within one body");
    }
  }
  return {};
}

// Rows of the items that mention each key, once however often they do; items stay ascending in a row.
template <std::size_t K>
Csr invert(std::span<const std::array<std::uint32_t, K>> lists, std::size_t rows) {
  Csr csr;
  csr.begin.assign(rows + 1, 0);
  const auto for_each_key = [](const auto& list, auto&& visit) {
    for (std::size_t k = 0; k < K; ++k)
      if (std::find(list.begin(), list.begin() + k, list[k]) == list.begin() + k) visit(list[k]);
  };
  for (const auto& list : lists) for_each_key(list, [&](std::uint32_t key) { ++csr.begin[key + 1]; });
  std::partial_sum(csr.begin.begin(), csr.begin.end(), csr.begin.begin());
  csr.items.resize(csr.begin.back());
  std::vector<std::uint32_t> cursor(csr.begin.begin(), csr.begin.end() - 1);
  for (std::size_t i = 0; i < lists.size(); ++i) {
    for_each_key(lists[i],
                 [&](std::uint32_t key) { csr.items[cursor[key]++] = static_cast<std::uint32_t>(i); });
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
  if (could_never_touch(description))
    return Error{ErrorCode::kUnimplemented,
                 "faces: none over " + std::to_string(description.vertex_count) +
                     " vertices; points and edges alone are not modelled yet: give triangles, or declare "
                     "bodies to add some later"};
  // Primitive, side and node numbers are 32 bit.
  if (description.faces.size() + description.vertex_count > 0x3fffffff) {
    return invalid_argument("faces: " + std::to_string(description.faces.size()) + " and " +
                            std::to_string(description.vertex_count) +
                            " vertices are together more than 2^30 - 1");
  }

  Scene scene;
  Mesh& mesh = scene.own_mesh();
  mesh.vertex_count = description.vertex_count;
  mesh.faces.reserve(description.faces.size());
  for (const auto& face : description.faces) {
    mesh.faces.push_back({static_cast<std::uint32_t>(face[0]), static_cast<std::uint32_t>(face[1]),
                          static_cast<std::uint32_t>(face[2])});
  }
  EdgeTable table = find_edges(mesh.faces);
  mesh.edges = std::move(table.edges);
  mesh.face_edges = std::move(table.face_edges);
  mesh.vertex_faces = invert<3>(mesh.faces, mesh.vertex_count);
  mesh.edge_faces = invert<3>(mesh.face_edges, mesh.edges.size());
  for (std::uint32_t v = 0; v < mesh.vertex_count; ++v) {
    if (mesh.vertex_faces[v].empty()) mesh.isolated_vertices.push_back(v);
  }
  if (Status status = scene.take_bodies(description); !status) return status.error();
  return scene;
}

Status Scene::take_bodies(SceneDescription& description) {
  Mesh& mesh = own_mesh();
  bodies_ = std::move(description.bodies);
  excluded_pairs_ = std::move(description.excluded_pairs);
  if (bodies_.empty()) {
    mesh.body_of_vertex = connected_components(mesh.faces, mesh.vertex_count, mesh.body_count);
    return {};
  }
  mesh.body_count = static_cast<std::uint32_t>(bodies_.size());
  name_bytes_ = 0;
  for (const Body& body : bodies_) name_bytes_ += body.name.size();
  mesh.body_of_vertex.clear();
  mesh.body_of_vertex.reserve(mesh.vertex_count);
  for (std::uint32_t b = 0; b < mesh.body_count; ++b)
    mesh.body_of_vertex.insert(mesh.body_of_vertex.end(), bodies_[b].vertex_count, b);
  return check_faces_of_bodies(mesh.faces, mesh.body_of_vertex);
}

Result<Scene> Scene::with_bodies(std::vector<Body> bodies) const {
  SceneDescription description{vertex_count(), {}, std::move(bodies)};
  if (Status status = check_bodies(description); !status) return status.error();
  Scene scene = *this;
  if (Status status = scene.take_bodies(description); !status) return status.error();
  return scene;
}

namespace {

void append_rows(Csr& to, const Csr& rows, std::uint32_t shift) {
  const std::uint32_t base = to.begin.empty() ? 0 : to.begin.back();
  if (to.begin.empty()) to.begin.push_back(0);
  for (std::size_t row = 1; row < rows.begin.size(); ++row) to.begin.push_back(base + rows.begin[row]);
  for (const std::uint32_t item : rows.items) to.items.push_back(item + shift);
}

}  // namespace

Result<Scene> Scene::with_body(BodyAddition addition) const {
  const std::string where = name_of(bodies_.size());
  if (bodies_.empty())
    return Error{ErrorCode::kFailedPrecondition,
                 "bodies: the scene declares none; declare its bodies to add one"};
  if (Status status = check_body(addition.body, where); !status) return status.error();
  // As a body: points of their own may be added to a scene, whose faces they meet.
  SceneDescription description{addition.body.vertex_count, std::move(addition.faces), {addition.body}};
  description.bodies.front().first_vertex = 0;
  Result<Scene> added = create(std::move(description));
  if (!added) return Error{added.error().code, where + ": " + added.error().message};
  const Mesh& body = *added.value().mesh_;
  if (mesh_->faces.size() + body.faces.size() + std::size_t{mesh_->vertex_count} + body.vertex_count >
      0x3fffffff)
    return invalid_argument(where + ": the scene would have more than 2^30 - 1 faces and vertices");

  Scene scene = *this;
  Mesh& mesh = scene.own_mesh();
  const std::uint32_t vertex = vertex_count();
  const std::uint32_t face = face_count();
  const std::uint32_t edge = edge_count();
  mesh.vertex_count += body.vertex_count;
  for (const Face& f : body.faces) mesh.faces.push_back({f[0] + vertex, f[1] + vertex, f[2] + vertex});
  for (const Edge& e : body.edges) mesh.edges.push_back({e[0] + vertex, e[1] + vertex});
  for (const auto& e : body.face_edges) mesh.face_edges.push_back({e[0] + edge, e[1] + edge, e[2] + edge});
  append_rows(mesh.vertex_faces, body.vertex_faces, face);
  append_rows(mesh.edge_faces, body.edge_faces, face);
  for (const std::uint32_t v : body.isolated_vertices) mesh.isolated_vertices.push_back(v + vertex);
  addition.body.first_vertex = vertex;
  scene.name_bytes_ += addition.body.name.size();
  scene.bodies_.push_back(std::move(addition.body));
  mesh.body_of_vertex.insert(mesh.body_of_vertex.end(), body.vertex_count, mesh.body_count);
  ++mesh.body_count;
  return scene;
}

Result<Scene> Scene::with_body_changed(std::uint32_t index, Body body) const {
  if (index >= bodies_.size())
    return invalid_argument("body " + std::to_string(index) + " is not in [0, " +
                            std::to_string(bodies_.size()) + ")");
  body.first_vertex = bodies_[index].first_vertex;
  body.vertex_count = bodies_[index].vertex_count;
  if (Status status = check_body(body, name_of(index)); !status) return status.error();
  Scene scene = *this;
  scene.name_bytes_ += body.name.size() - scene.bodies_[index].name.size();
  scene.bodies_[index] = std::move(body);
  return scene;
}

std::array<std::uint32_t, 4> Scene::vertices_of(const Contact& contact) const {
  if (contact.kind == ContactKind::kVertexFace) {
    const Face& face = mesh_->faces[contact.b];
    return {contact.a, face[0], face[1], face[2]};
  }
  const Edge& a = mesh_->edges[contact.a];
  const Edge& b = mesh_->edges[contact.b];
  return {a[0], a[1], b[0], b[1]};
}

FeatureRange features_of(const Scene& scene, std::uint32_t first_vertex, std::uint32_t end_vertex) {
  // Edges are sorted by their vertices as first given, and bodies are ranges of these.
  const auto edges_before = [&](std::uint32_t vertex) {
    return static_cast<std::uint32_t>(
        std::ranges::partition_point(scene.edges(), [&](const Edge& e) { return e[0] < vertex; }) -
        scene.edges().begin());
  };
  return {first_vertex, end_vertex, edges_before(first_vertex), edges_before(end_vertex)};
}

std::size_t Scene::memory_bytes() const {
  return mesh_->faces.size() * sizeof(Face) + mesh_->edges.size() * sizeof(Edge) +
         mesh_->face_edges.size() * sizeof(mesh_->face_edges[0]) + mesh_->vertex_faces.memory_bytes() +
         mesh_->edge_faces.memory_bytes() +
         (mesh_->isolated_vertices.size() + mesh_->body_of_vertex.size()) * sizeof(std::uint32_t) +
         bodies_.size() * sizeof(Body) + name_bytes_ + excluded_pairs_.size() * sizeof(excluded_pairs_[0]);
}

}  // namespace warmfront
