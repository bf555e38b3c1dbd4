// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/topology.h"

#include <algorithm>

#include "engine/bvh/build.h"
#include "engine/parallel/fork_join.h"
#include "engine/scene/adjacency.h"
#include "engine/scene/held_bytes.h"

namespace warmfront {
namespace {

// The primitives of vertices [first, end), in given numbers; the faces of one body are not always a range.
std::vector<std::vector<Primitive>> primitives_of_parts(const Scene& given, std::size_t first_part,
                                                        std::size_t parts, std::uint32_t first_face,
                                                        StopSignal stop) {
  std::vector<std::vector<Primitive>> primitives(parts);
  const auto part_of = [&](std::uint32_t v) {
    return given.bodies().empty() ? 0 : given.body_of_vertex()[v];
  };
  PacedStop paced(stop);
  for (std::uint32_t f = first_face; f < given.face_count(); ++f) {
    paced.check();
    primitives[part_of(given.faces()[f][0])].push_back(primitive_of_face(f));
  }
  for (const EdgeId e : lone_edges(given)) {
    const std::size_t part = part_of(ends_of(given, e)[0]);
    if (part >= first_part) primitives[part].push_back(primitive_of_edge(e));
  }
  for (const std::uint32_t v : given.isolated_vertices()) {
    if (part_of(v) >= first_part) primitives[part_of(v)].push_back(primitive_of_vertex(v));
  }
  return primitives;
}

}  // namespace

Topology::Topology(const Scene& given, const Motion& motion, std::uint32_t leaf_size, bool cones,
                   StopSignal stop)
    : leaf_size_(leaf_size), cones_(cones), ownership(scene) {
  add_parts(given, motion, stop);
  // Found in given numbers, so that they do not depend on the first positions.
  if (cones) patches = numbering.apply(find_patches(given, kPatchRings, stop));
  patches.of_face.resize(given.face_count(), Patches::kNone);
}

void Topology::extend(const Scene& given, const Motion& motion, StopSignal stop) {
  add_parts(given, motion, stop);
  patches.of_face.resize(given.face_count(), Patches::kNone);
}

void Topology::truncate(const Extent& extent) noexcept {
  while (parts.size() > extent.parts) parts.pop_back();
  numbering.truncate(extent.scene, scene);
  ownership.truncate(extent.scene.faces);
  patches.of_face.resize(std::min<std::size_t>(extent.scene.faces, patches.of_face.size()));
  adjacent_pairs = extent.adjacent_pairs;
}

void Topology::add_parts(const Scene& given, const Motion& motion, StopSignal stop) {
  const std::size_t first = parts.size();
  const std::size_t count = given.bodies().empty() ? 1 : given.bodies().size();
  std::vector<std::vector<Primitive>> primitives =
      primitives_of_parts(given, first, count, scene.face_count(), stop);
  parts.resize(count);
  fork_each(first, count, [&](std::size_t p) {
    stop.check();
    PartTopology& part = parts[p];
    part.features = given.bodies().empty()
                        ? whole(given)
                        : features_of(given, given.bodies()[p].first_vertex,
                                      given.bodies()[p].first_vertex + given.bodies()[p].vertex_count);
    part.shape = TreeShape(static_cast<std::uint32_t>(primitives[p].size()), leaf_size_);
    part.order = build_order(given, motion, part.shape, primitives[p], stop);
  });
  std::vector<Primitive> order;
  std::uint32_t next_face = scene.face_count();
  for (std::size_t p = first; p < count; ++p) {
    parts[p].first_face = next_face;
    for (const Primitive primitive : parts[p].order) next_face += is_face(primitive) ? 1 : 0;
    parts[p].end_face = next_face;
  }
  for (std::size_t p = first; p < count; ++p)
    order.insert(order.end(), parts[p].order.begin(), parts[p].order.end());
  numbering.extend(given, order, stop);
  numbering.extend(given, scene, stop);
  std::vector<std::uint64_t> adjacent(count - first);
  const auto count_adjacent = [&](std::size_t p) {
    stop.check();
    for (Primitive& primitive : parts[p].order) primitive = numbering.apply(primitive);
    adjacent[p - first] = count_adjacent_pairs(scene, parts[p].features, stop);
  };
  fork_two([&] { ownership.extend(stop); }, [&] { fork_each(first, count, count_adjacent); });
  for (const std::uint64_t pairs : adjacent) adjacent_pairs += pairs;
}

void PartTopology::shift(const NumberShift& by) noexcept {
  if (!by.any()) return;
  features.first_vertex += by.vertex;
  features.end_vertex += by.vertex;
  features.first_edge += by.edge;
  features.end_edge += by.edge;
  first_face += by.face;
  end_face += by.face;
  for (Primitive& primitive : order) primitive = shifted(primitive, by);
  for (VertexFaceIds& pair : orphans.vertex_face) pair = {pair.a + by.vertex, pair.b + by.face};
  for (EdgeEdgeIds& pair : orphans.edge_edge) pair = {pair.a + by.edge, pair.b + by.edge};
}

void Topology::need_adjacent(PartId index, StopSignal stop) {
  PartTopology& part = parts[number_of(index)];
  if (part.has_adjacent) return;
  fork_two([&] { part.orphans = enumerate_orphans(scene, part.features, stop); },
           [&] { part.shared = shared_vertices(scene, part.shape, part.order, stop); });
  part.has_adjacent = true;
}

std::size_t Topology::memory_bytes() const {
  constexpr std::size_t kOfDeque = 1 << 10;  // an empty one's map, and what its last block has room for
  std::size_t bytes = sizeof(*this) + kOfDeque + numbering.memory_bytes() + scene.memory_bytes() +
                      patches.memory_bytes() + ownership.memory_bytes();
  for (const PartTopology& part : parts) {
    bytes += sizeof(part) + part.shape.memory_bytes() +
             held_bytes(part.order, part.orphans.vertex_face, part.orphans.edge_edge) +
             (part.shared != nullptr ? part.shared->memory_bytes() : 0);
  }
  return bytes;
}

}  // namespace warmfront
