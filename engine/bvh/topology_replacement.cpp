// SPDX-License-Identifier: Apache-2.0
#include "engine/bvh/topology_replacement.h"

#include <algorithm>
#include <utility>

#include "engine/bvh/build.h"
#include "engine/bvh/topology_checksum.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/scene/adjacency.h"
#include "engine/scene/changed_scene.h"

namespace warmfront {
namespace {

std::vector<Primitive> primitives_of(const Scene& given) {
  std::vector<Primitive> primitives;
  primitives.reserve(given.element_count() + given.isolated_vertices().size());
  for (std::uint32_t f = 0; f < given.face_count(); ++f) primitives.push_back(primitive_of_face(f));
  for (const EdgeId e : lone_edges(given)) primitives.push_back(primitive_of_edge(e));
  for (const std::uint32_t v : given.isolated_vertices()) primitives.push_back(primitive_of_vertex(v));
  return primitives;
}

}  // namespace

TopologyReplacement::TopologyReplacement(Topology& topology, std::span<const NewPart> parts,
                                         std::span<const std::uint32_t> face_rank, StopSignal stop)
    : topology_(topology), parts_before_(topology.parts.size()), made_(parts.size()) {
  const std::size_t count = std::max<std::size_t>(parts_before_, std::size_t{parts.back().piece->body} + 1);
  new_of_.resize(count, kOld);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    made_[i] = std::make_unique<Made>();
    new_of_[parts[i].piece->body] = static_cast<std::uint32_t>(i);
  }
  fork_each(std::size_t{0}, parts.size(), [&](std::size_t i) {
    stop.check();
    make(parts[i], *made_[i], stop);
  });
  place_parts();
  join(face_rank, stop);
  adjacent_pairs_ = topology.adjacent_pairs;
  for (std::uint32_t p = 0; p < count; ++p) {
    if (is_new(PartId{p})) adjacent_pairs_ += made_[new_of_[p]]->more_adjacent_pairs;
  }
  try {
    while (topology.parts.size() < count) topology.parts.emplace_back();
  } catch (...) {
    while (topology.parts.size() > parts_before_) topology.parts.pop_back();
    throw;
  }
}

TopologyReplacement::~TopologyReplacement() {
  if (taken_) return;
  while (topology_.parts.size() > parts_before_) topology_.parts.pop_back();
}

std::uint64_t TopologyReplacement::more_adjacent_pairs(const Made& made, std::uint32_t index,
                                                       StopSignal stop) const {
  const FeatureRange& features = made.part.features;
  if (const std::optional<LocalChange>& change = made.change; change) {
    const FeatureRange& before = topology_.parts[index].features;
    std::vector<std::uint32_t> vertices_before(change->at);
    for (std::uint32_t& v : vertices_before) v += before.first_vertex;
    std::vector<EdgeId> edges, edges_before;
    for (const LocalChange::Touched& edge : change->touched) {
      if (!edge.of_face) continue;
      if (edge.now != LocalChange::kNoEdge) edges.push_back(edge.now);
      if (edge.before != LocalChange::kNoEdge)
        edges_before.push_back(before.first_edge + number_of(edge.before));
    }
    return count_adjacent_pairs_at(made.scene, change->at, edges, stop) -
           count_adjacent_pairs_at(topology_.scene, vertices_before, edges_before, stop);
  }
  std::uint64_t more = count_adjacent_pairs(made.scene, features, stop);
  if (index < parts_before_)
    more -= count_adjacent_pairs(topology_.scene, topology_.parts[index].features, stop);
  return more;
}

void TopologyReplacement::make(const NewPart& from, Made& made, StopSignal stop) const {
  const Scene& given = from.piece->alone;
  PartTopology& part = made.part;
  const std::uint32_t index = from.piece->body;
  std::optional<LocalChange>& change = made.change;
  if (from.change != nullptr) change = std::move(*from.change);
  MeshRange before;
  if (change) before = topology_.parts[index].range();
  std::optional<KeptOrder> kept;
  if (change)
    kept = keep_order(from.held, topology_.scene, topology_.numbering, before, given, *change, stop);
  made.keeps_hierarchy = kept.has_value();
  if (kept) {
    part.shape = std::move(kept->shape);
    part.order = std::move(kept->order);
  } else {
    const std::vector<Primitive> primitives = primitives_of(given);
    const auto count = static_cast<std::uint32_t>(primitives.size());
    // What has changed locally, and found no room, is likely to do so again.
    part.shape = change && !from.held.order.empty() ? from.held.shape.with_more_room(count)
                                                    : TreeShape(count, topology_.leaf_size_);
    const std::vector<double> positions = from.positions();
    part.order = build_order(given, Motion(positions, stop), part.shape, primitives, stop);
  }
  if (!from.given_vertices.empty()) made.numbering = Renumbering(from.given_vertices);
  made.numbering.extend(given, part.order, stop);
  if (change) {
    change->renumber(topology_.numbering, before, made.numbering,
                     kept ? std::move(kept->face_before) : std::vector<std::uint32_t>(), stop);
    made.scene = ChangedScene::renumbered(topology_.scene, before, given, made.numbering, *change, stop);
  } else {
    made.numbering.extend(given, made.scene, stop);
  }
  std::uint32_t next_face = 0;  // faces are numbered in this order
  for (Primitive& p : part.order) p = is_face(p) ? primitive_of_face(next_face++) : made.numbering.apply(p);
  part.features = whole(made.scene);
  part.end_face = made.scene.face_count();
  if (topology_.cones_) made.patches = made.numbering.apply(find_patches(given, kPatchRings, stop));
  made.patches.of_face.resize(given.face_count(), Patches::kNone);
  if (change && change->faces_ascend)
    made.owners_changed.emplace(made.scene, before, *change, stop);
  else if (change)
    made.ownership = std::make_unique<Ownership>(made.scene, topology_.ownership, before, *change, stop);
  else
    made.ownership = std::make_unique<Ownership>(made.scene);
  made.more_adjacent_pairs = more_adjacent_pairs(made, index, stop);
  if (kept) made.changed_blocks = std::move(kept->changed);
  if (!from.tests_itself) return;
  if (change && topology_.parts[index].has_adjacent)
    part.orphans = enumerate_orphans(made.scene, topology_.parts[index].orphans, before, *change, stop);
  else
    part.orphans = enumerate_orphans(made.scene, part.features, stop);
  part.shared =
      kept && from.held.shared != nullptr
          ? shared_vertices(made.scene, part.shape, part.order, *from.held.shared, made.changed_blocks, stop)
          : shared_vertices(made.scene, part.shape, part.order, stop);
  part.has_adjacent = true;
}

// Where each part is when all follow each other.
void TopologyReplacement::place_parts() {
  ranges_.reserve(new_of_.size());
  shifts_.reserve(new_of_.size());
  MeshRange next;
  for (std::size_t p = 0; p < new_of_.size(); ++p) {
    const MeshRange from = new_of_[p] == kOld ? topology_.parts[p].range() : made_[new_of_[p]]->part.range();
    MeshRange& to = ranges_.emplace_back(next);
    to.features.end_vertex = to.features.first_vertex + from.vertex_count();
    to.features.end_edge = to.features.first_edge + from.edge_count();
    to.end_face = to.first_face + from.face_count();
    shifts_.push_back(shift_between(from, to));
    next = {{to.features.end_vertex, to.features.end_vertex, to.features.end_edge, to.features.end_edge},
            to.end_face,
            to.end_face};
  }
}

// Of runs of parts that are as they were, and of the others.
void TopologyReplacement::join(std::span<const std::uint32_t> face_rank, StopSignal stop) {
  std::vector<SceneSlice> scenes;
  std::vector<Renumbering::Slice> numberings;
  std::vector<PatchesSlice> patches;
  for (std::uint32_t p = 0; p < part_count();) {
    const std::uint32_t first = p++;
    const NumberShift& shift = shifts_[first];
    if (is_new(PartId{first})) {
      Made& made = *made_[new_of_[first]];
      const MeshRange range = made.part.range();
      scenes.push_back({&made.scene, range, first, &made.scene});
      numberings.push_back({&made.numbering, range});
      ownerships_.push_back({made.ownership.get(), range.first_face, range.end_face, shift,
                             made.owners_changed ? &*made.owners_changed : nullptr});
      if (made.owners_changed) {
        for (const Run& run : made.change->face_runs)
          face_runs_.push_back(
              {topology_.parts[first].first_face + run.from, run.count, ranges_[first].first_face + run.to});
      }
      patches.push_back({&made.patches, range.first_face, range.end_face, shift});
      continue;
    }
    while (p < part_count() && !is_new(PartId{p})) ++p;
    MeshRange range = topology_.parts[first].range();
    const MeshRange last = topology_.parts[p - 1].range();
    range.features.end_vertex = last.features.end_vertex;
    range.features.end_edge = last.features.end_edge;
    range.end_face = last.end_face;
    scenes.push_back({&topology_.scene, range});
    numberings.push_back({&topology_.numbering, range, face_rank});
    ownerships_.push_back({nullptr, range.first_face, range.end_face, shift});
    face_runs_.push_back({range.first_face, range.face_count(), ranges_[first].first_face});
    patches.push_back({&topology_.patches, range.first_face, range.end_face, shift});
  }
  scene_ = SceneJoin::join(scenes, part_count(), stop);
  numbering_ = Renumbering::join(numberings, stop);
  topology_.ownership.make_room(scene_.face_count(), stop);
  patches_ = join_patches(patches, stop);
}

std::uint64_t TopologyReplacement::orphans_sum(PartId part, StopSignal stop) const {
  return orphans_checksum(made_[new_of_[number_of(part)]]->part, number_of(part), stop);
}

void TopologyReplacement::take() noexcept {
  taken_ = true;
  topology_.numbering = std::move(numbering_);
  topology_.scene = std::move(scene_);
  topology_.ownership.splice(ownerships_, face_runs_, topology_.scene.face_count());
  topology_.patches = std::move(patches_);
  topology_.adjacent_pairs = adjacent_pairs_;
  for (std::uint32_t p = 0; p < part_count(); ++p) {
    PartTopology& part = topology_.parts[p];
    if (is_new(PartId{p})) part = std::move(made_[new_of_[p]]->part);
    part.shift(shifts_[p]);
  }
}

}  // namespace warmfront
