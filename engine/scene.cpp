// SPDX-License-Identifier: Apache-2.0
#include "engine/scene.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

Status check_faces(const SceneDescription& description, StopSignal stop) {
  PacedStop paced(stop);
  const auto n = static_cast<std::int64_t>(description.vertex_count);
  for (std::size_t f = 0; f < description.faces.size(); ++f) {
    paced.check();
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

// No pair can ever be in contact, even after later changes.
bool could_never_touch(const SceneDescription& description) {
  return description.vertex_count > 0 && description.faces.empty() && description.bodies.empty();
}

std::string name_of(std::size_t body) {
  return "bodies[" + std::to_string(body) + "]";
}

// Checks a body's description, except its range.
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

Status check_bodies(const SceneDescription& description, StopSignal stop) {
  PacedStop paced(stop);
  std::uint64_t next = 0;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    paced.check();
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
    paced.check();
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

Status check_faces_of_bodies(std::span<const Face> faces, std::span<const std::uint32_t> body_of_vertex,
                             StopSignal stop) {
  PacedStop paced(stop);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    paced.check();
    for (const std::uint32_t v : faces[f]) {
      const std::uint32_t body = body_of_vertex[faces[f][0]];
      if (body_of_vertex[v] != body)
        return invalid_argument("faces[" + std::to_string(f) + "]: joins " + name_of(body) + " and " +
                                name_of(body_of_vertex[v]) + "; a face lies within one body");
    }
  }
  return {};
}

// For each key, the items that contain it, each once and ascending.
template <std::size_t K>
Csr invert(std::span<const std::array<std::uint32_t, K>> lists, std::size_t rows, StopSignal stop) {
  Csr csr;
  lengthen(csr.begin, rows + 1, 0U, stop);
  const auto for_each_key = [](const auto& list, auto&& visit) {
    for (std::size_t k = 0; k < K; ++k)
      if (std::find(list.begin(), list.begin() + k, list[k]) == list.begin() + k) visit(list[k]);
  };
  in_pieces(0, lists.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      for_each_key(lists[i], [&](std::uint32_t key) { ++csr.begin[key + 1]; });
  });
  in_pieces(1, csr.begin.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t row = first; row < end; ++row) csr.begin[row] += csr.begin[row - 1];
  });
  lengthen(csr.items, csr.begin.back(), 0U, stop);
  std::vector<std::uint32_t> cursor;
  append(cursor, std::span<const std::uint32_t>(csr.begin), stop);
  in_pieces(0, lists.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i)
      for_each_key(lists[i],
                   [&](std::uint32_t key) { csr.items[cursor[key]++] = static_cast<std::uint32_t>(i); });
  });
  return csr;
}

struct EdgeTable {
  std::vector<Edge> edges;
  std::vector<std::array<std::uint32_t, 3>> face_edges;
};

EdgeTable find_edges(std::span<const Face> faces, StopSignal stop) {
  PacedStop paced(stop);
  struct Side {
    Edge edge;
    std::uint32_t face_side;  // 3 * face + side
  };
  std::vector<Side> sides;
  sides.reserve(faces.size() * 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    paced.check();
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = faces[f][side];
      const std::uint32_t to = faces[f][(side + 1) % 3];
      sides.push_back({{std::min(from, to), std::max(from, to)}, static_cast<std::uint32_t>(3 * f + side)});
    }
  }
  std::sort(sides.begin(), sides.end(), [&](const Side& x, const Side& y) {
    paced.check();
    return std::tie(x.edge, x.face_side) < std::tie(y.edge, y.face_side);
  });
  std::size_t edges = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    paced.check();
    edges += i == 0 || sides[i].edge != sides[i - 1].edge ? 1 : 0;
  }
  EdgeTable table;
  table.edges.reserve(edges);
  lengthen(table.face_edges, faces.size(), {}, stop);
  for (const Side& side : sides) {
    paced.check();
    if (table.edges.empty() || table.edges.back() != side.edge) table.edges.push_back(side.edge);
    table.face_edges[side.face_side / 3][side.face_side % 3] =
        static_cast<std::uint32_t>(table.edges.size() - 1);
  }
  return table;
}

// Connected components of the faces (isolated vertices are components of their own), numbered by their least
// vertex.
std::vector<std::uint32_t> connected_components(std::span<const Face> faces, std::uint32_t vertex_count,
                                                std::uint32_t& count, StopSignal stop) {
  PacedStop paced(stop);
  std::vector<std::uint32_t> root(vertex_count);
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&root](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const Face& face : faces) {
    paced.check();
    for (int corner = 1; corner < 3; ++corner) {
      const std::uint32_t a = find(face[0]);
      const std::uint32_t b = find(face[corner]);
      root[std::max(a, b)] = std::min(a, b);  // a root is always the least vertex of its component
    }
  }
  std::vector<std::uint32_t> component(vertex_count);
  count = 0;
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    paced.check();
    const std::uint32_t r = find(v);
    component[v] = r == v ? count++ : component[r];
  }
  return component;
}

}  // namespace

Result<Scene> Scene::create(SceneDescription description, StopSignal stop) {
  if (Status status = check_faces(description, stop); !status) return status.error();
  if (Status status = check_bodies(description, stop); !status) return status.error();
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
  in_pieces(0, description.faces.size(), stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t f = first; f < end; ++f) {
      const auto& face = description.faces[f];
      mesh.faces.push_back({static_cast<std::uint32_t>(face[0]), static_cast<std::uint32_t>(face[1]),
                            static_cast<std::uint32_t>(face[2])});
    }
  });
  EdgeTable table = find_edges(mesh.faces, stop);
  mesh.edges = std::move(table.edges);
  mesh.face_edges = std::move(table.face_edges);
  mesh.vertex_faces = invert<3>(mesh.faces, mesh.vertex_count, stop);
  mesh.edge_faces = invert<3>(mesh.face_edges, mesh.edges.size(), stop);
  in_pieces(0, mesh.vertex_count, stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t v = first; v < end; ++v)
      if (mesh.vertex_faces[v].empty()) mesh.isolated_vertices.push_back(static_cast<std::uint32_t>(v));
  });
  if (Status status = scene.take_bodies(description, stop); !status) return status.error();
  return scene;
}

Status Scene::take_bodies(SceneDescription& description, StopSignal stop) {
  Mesh& mesh = own_mesh();
  bodies_ = std::move(description.bodies);
  excluded_pairs_ = std::move(description.excluded_pairs);
  if (bodies_.empty()) {
    mesh.body_of_vertex = connected_components(mesh.faces, mesh.vertex_count, mesh.body_count, stop);
    return {};
  }
  mesh.body_count = static_cast<std::uint32_t>(bodies_.size());
  name_bytes_ = 0;
  mesh.body_of_vertex.clear();
  reserve(mesh.body_of_vertex, mesh.vertex_count, stop);
  PacedStop paced(stop);
  for (std::uint32_t b = 0; b < mesh.body_count; ++b) {
    paced.check();
    name_bytes_ += bodies_[b].name.size();
    lengthen(mesh.body_of_vertex, mesh.body_of_vertex.size() + bodies_[b].vertex_count, b, stop);
  }
  return check_faces_of_bodies(mesh.faces, mesh.body_of_vertex, stop);
}

Result<Scene> Scene::with_bodies(std::vector<Body> bodies, StopSignal stop) const {
  SceneDescription description{vertex_count(), {}, std::move(bodies)};
  if (Status status = check_bodies(description, stop); !status) return status.error();
  Scene scene = *this;
  if (Status status = scene.take_bodies(description, stop); !status) return status.error();
  return scene;
}

namespace {

// Appends the same list of several meshes, with `shift` added to every number in it.
template <class T, class List, class Shift>
void join(std::vector<T>& to, const auto& meshes, StopSignal stop, List&& list, Shift&& shift) {
  std::size_t size = 0;
  for (const auto& mesh : meshes) size += list(*mesh).size();
  to.reserve(size);
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const std::vector<T>& from = list(*meshes[m]);
    const std::uint32_t more = shift(m);
    in_pieces(0, from.size(), stop, [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) {
        T item = from[i];
        if constexpr (requires { item[0]; }) {
          for (std::uint32_t& number : item) number += more;
        } else {
          item += more;
        }
        to.push_back(item);
      }
    });
  }
}

}  // namespace

std::shared_ptr<Scene::Mesh> Scene::joined(std::span<const std::shared_ptr<Mesh>> meshes, StopSignal stop) {
  auto result = std::make_shared<Mesh>();
  Mesh& to = *result;
  struct First {
    std::uint32_t vertex, face, edge, body, vertex_item, edge_item;
  };
  std::vector<First> first;
  first.reserve(meshes.size());
  First next{};
  const auto size = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  for (const auto& mesh : meshes) {
    first.push_back(next);
    next = {next.vertex + mesh->vertex_count,
            next.face + size(mesh->faces),
            next.edge + size(mesh->edges),
            next.body + mesh->body_count,
            next.vertex_item + size(mesh->vertex_faces.items),
            next.edge_item + size(mesh->edge_faces.items)};
  }
  to.vertex_count = next.vertex;
  to.body_count = next.body;
  const auto by_vertex = [&](std::size_t m) { return first[m].vertex; };
  const auto by_face = [&](std::size_t m) { return first[m].face; };
  const auto by_edge = [&](std::size_t m) { return first[m].edge; };
  join(
      to.faces, meshes, stop, [](const Mesh& m) -> auto& { return m.faces; }, by_vertex);
  join(
      to.edges, meshes, stop, [](const Mesh& m) -> auto& { return m.edges; }, by_vertex);
  join(
      to.face_edges, meshes, stop, [](const Mesh& m) -> auto& { return m.face_edges; }, by_edge);
  // Offsets continue from the previous mesh: all but each list's leading 0 is appended.
  const auto join_rows = [&](Csr& rows, auto&& of, auto&& first_item) {
    join(
        rows.items, meshes, stop, [&](const Mesh& m) -> auto& { return of(m).items; }, by_face);
    std::size_t count = 1;
    for (const auto& mesh : meshes) count += of(*mesh).rows();
    rows.begin.reserve(count);
    rows.begin.push_back(0);
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      const std::vector<std::uint32_t>& from = of(*meshes[m]).begin;
      in_pieces(1, from.size(), stop, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) rows.begin.push_back(first_item(m) + from[row]);
      });
    }
  };
  join_rows(
      to.vertex_faces, [](const Mesh& m) -> const Csr& { return m.vertex_faces; },
      [&](std::size_t m) { return first[m].vertex_item; });
  join_rows(
      to.edge_faces, [](const Mesh& m) -> const Csr& { return m.edge_faces; },
      [&](std::size_t m) { return first[m].edge_item; });
  join(
      to.isolated_vertices, meshes, stop, [](const Mesh& m) -> auto& { return m.isolated_vertices; },
      by_vertex);
  join(
      to.body_of_vertex, meshes, stop, [](const Mesh& m) -> auto& { return m.body_of_vertex; },
      [&](std::size_t m) { return first[m].body; });
  return result;
}

Result<Scene> Scene::with_body(BodyAddition addition) const {
  std::array<SceneChange, 1> changes{AddBody{std::move(addition), {}}};
  std::size_t failed = 0;
  return with_changes(changes, failed);
}

Result<Scene> Scene::with_body_changed(std::uint32_t index, Body body) const {
  Scene scene = *this;
  if (Status status = scene.change(index, std::move(body)); !status) return status.error();
  return scene;
}

Result<Scene> Scene::with_changes(std::span<SceneChange> changes, std::size_t& failed,
                                  StopSignal stop) const {
  Scene scene = *this;
  const auto additions = static_cast<std::size_t>(std::ranges::count_if(
      changes, [](const SceneChange& change) { return std::holds_alternative<AddBody>(change); }));
  if (additions > 0) scene.bodies_.reserve(bodies_.size() + additions);
  std::vector<std::shared_ptr<Mesh>> meshes{mesh_};
  meshes.reserve(1 + additions);
  std::uint64_t vertices = vertex_count();
  std::uint64_t faces = face_count();
  const auto add = [&](BodyAddition& addition) -> Status {
    const std::string where = name_of(scene.bodies_.size());
    if (bodies_.empty())
      return Error{ErrorCode::kFailedPrecondition,
                   "bodies: the scene declares none; declare its bodies to add one"};
    if (Status status = check_body(addition.body, where); !status) return status.error();
    // Checked as a body: unlike a scene, it may have no faces, since its points may meet the scene's faces.
    SceneDescription description{addition.body.vertex_count, std::move(addition.faces), {addition.body}};
    description.bodies.front().first_vertex = 0;
    Result<Scene> added = create(std::move(description), stop);
    if (!added) return Error{added.error().code, where + ": " + added.error().message};
    addition.body.first_vertex = static_cast<std::uint32_t>(vertices);
    vertices += added.value().vertex_count();
    faces += added.value().face_count();
    if (vertices + faces > 0x3fffffff)
      return invalid_argument(where + ": the scene would have more than 2^30 - 1 faces and vertices");
    meshes.push_back(added.value().mesh_);
    scene.name_bytes_ += addition.body.name.size();
    scene.bodies_.push_back(std::move(addition.body));
    return {};
  };
  for (failed = 0; failed < changes.size(); ++failed) {
    stop.check();
    if (auto* added = std::get_if<AddBody>(&changes[failed])) {
      if (Status status = add(added->addition); !status) return status.error();
      continue;
    }
    auto& [index, body] = std::get<ChangeBody>(changes[failed]);
    if (index < scene.bodies_.size() && scene.bodies_[index].kind == BodyKind::kRemoved)
      return invalid_argument("body " + std::to_string(index) + " was removed; add a new one");
    if (Status status = scene.change(index, std::move(body)); !status) return status.error();
  }
  if (additions > 0) scene.mesh_ = joined(meshes, stop);
  return scene;
}

Status Scene::change(std::uint32_t index, Body body) {
  if (index >= bodies_.size())
    return invalid_argument("body " + std::to_string(index) + " is not in [0, " +
                            std::to_string(bodies_.size()) + ")");
  body.first_vertex = bodies_[index].first_vertex;
  body.vertex_count = bodies_[index].vertex_count;
  if (Status status = check_body(body, name_of(index)); !status) return status.error();
  name_bytes_ += body.name.size() - bodies_[index].name.size();
  bodies_[index] = std::move(body);
  return {};
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
  // Edges are sorted by their vertices in original numbers, and bodies are ranges of these.
  const auto edges_before = [&](std::uint32_t vertex) {
    return static_cast<std::uint32_t>(
        std::ranges::partition_point(scene.edges(), [&](const Edge& e) { return e[0] < vertex; }) -
        scene.edges().begin());
  };
  return {first_vertex, end_vertex, edges_before(first_vertex), edges_before(end_vertex)};
}

std::size_t Scene::memory_bytes() const {
  return sizeof(*this) + sizeof(*mesh_) + mesh_->faces.capacity() * sizeof(Face) +
         mesh_->edges.capacity() * sizeof(Edge) +
         mesh_->face_edges.capacity() * sizeof(mesh_->face_edges[0]) + mesh_->vertex_faces.memory_bytes() +
         mesh_->edge_faces.memory_bytes() +
         (mesh_->isolated_vertices.capacity() + mesh_->body_of_vertex.capacity()) * sizeof(std::uint32_t) +
         bodies_.capacity() * sizeof(Body) + name_bytes_ +
         excluded_pairs_.capacity() * sizeof(excluded_pairs_[0]);
}

}  // namespace warmfront
