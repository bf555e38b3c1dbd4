// SPDX-License-Identifier: Apache-2.0
#include "engine/state/core_replacement.h"

#include <algorithm>
#include <utility>

#include "engine/bvh/topology_checksum.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

CoreReplacement::CoreReplacement(Core& core, const Scene& scene, ReplacedBodies& replaced,
                                 std::span<const std::span<const double>> positions,
                                 std::span<const HeldOrder> held, StopSignal stop)
    : core_(core),
      model_(scene, stop),
      new_parts_(new_parts(scene, replaced, positions, held, stop)),
      topology_(*core.topology, new_parts_, replaced.face_rank, stop) {
  changes_.reserve(topology_.part_count());
  for (std::uint32_t p = 0; p < topology_.part_count(); ++p) {
    const PartId part{p};
    PartChange& change = changes_.emplace_back();
    change.is_new = topology_.is_new(part);
    if (!change.is_new) {
      change.shift = topology_.shift(part);
      continue;
    }
    change.keeps_hierarchy = topology_.keeps_hierarchy(part);
    if (change.keeps_hierarchy &&
        topology_.ranges()[p].features.first_vertex == core.topology->parts[p].features.first_vertex)
      change.changed_blocks = topology_.changed_blocks(part);
  }
  for (const ReplacedBodies::Piece& piece : replaced.pieces)
    changes_[piece.body].keeps_vertices = piece.keeps_vertices();
  make_motion(scene, replaced, stop);
  excluded_pairs_ = model_.excluded_pairs(stop);
  std::vector<FeatureRange> ranges;
  ranges.reserve(topology_.part_count());
  for (const MeshRange& range : topology_.ranges()) ranges.push_back(range.features);
  filter_ =
      Core::make_filter(scene.filters(), model_, ranges, topology_.numbering(), topology_.scene(), stop);
  worlds_ = Worlds(scene, stop);
  thickness_ = Core::make_thickness(scene, ranges, topology_.numbering(), stop);
  make_orphans(stop);
  for (std::uint32_t p = 0; p < topology_.part_count(); ++p) {
    if (topology_.is_new(PartId{p})) continue;
    const FeatureRange& from = core.topology->parts[p].features;
    vertex_runs_.push_back({from.first_vertex, from.end_vertex - from.first_vertex,
                            topology_.ranges()[p].features.first_vertex});
  }
  make_room_for_runs(core.vertex_bounds, topology_.scene().vertex_count(), stop);
  patch_culled_.resize(topology_.patch_count());
  // Room that is not needed after all does no harm.
  core.rigid_parts.make_room(model_);
  core.orphans.resize(topology_.part_count());
}

std::vector<TopologyReplacement::NewPart> CoreReplacement::new_parts(
    const Scene& scene, ReplacedBodies& replaced, std::span<const std::span<const double>> positions,
    std::span<const HeldOrder> held, StopSignal stop) {
  std::vector<TopologyReplacement::NewPart> parts;
  parts.reserve(replaced.pieces.size());
  PacedStop paced(stop);
  for (ReplacedBodies::Piece& piece : replaced.pieces) {
    TopologyReplacement::NewPart& part = parts.emplace_back();
    part.piece = &piece;
    part.tests_itself = model_.self_collision(part_of_body(piece.body));
    if (!piece.keeps_vertices()) {
      const std::span<const double> given = positions[piece.positions_of];
      part.positions = [given] { return std::vector<double>(given.begin(), given.end()); };
      continue;
    }
    // Where faces were given in turns, what was given is not yet what the topology has.
    if (replaced.face_rank.empty()) {
      part.held = held[parts.size() - 1];
      if (piece.change) part.change = &*piece.change;
    }
    // Their numbers stay, and with them all that goes by these.
    const FeatureRange& features = core_.topology->parts[piece.body].features;
    part.given_vertices.reserve(scene.bodies()[piece.body].vertex_count);
    for (std::uint32_t v = features.first_vertex; v < features.end_vertex; ++v) {
      paced.check();
      part.given_vertices.push_back(
          GivenVertex{number_of(core_.topology->numbering.given(NewVertex{v})) - features.first_vertex});
    }
    part.positions = [this, &scene, body = piece.body, stop] { return gathered(scene, body, stop); };
  }
  return parts;
}

// Where the vertices of a body that keeps them are.
std::vector<double> CoreReplacement::gathered(const Scene& scene, std::uint32_t body, StopSignal stop) const {
  const FeatureRange& features = core_.topology->parts[body].features;
  std::vector<double> positions;
  lengthen(positions, std::size_t{3} * scene.bodies()[body].vertex_count, 0.0, stop);
  PacedStop paced(stop);
  for (std::uint32_t v = features.first_vertex; v < features.end_vertex; ++v) {
    paced.check();
    const std::uint32_t given =
        number_of(core_.topology->numbering.given(NewVertex{v})) - features.first_vertex;
    const VertexMotion vertex = core_.motion.vertex(part_of_body(body), v - features.first_vertex);
    std::copy_n(vertex.t1.begin(), 3, positions.begin() + std::ptrdiff_t{3} * given);
  }
  return positions;
}

void CoreReplacement::make_motion(const Scene& scene, const ReplacedBodies& replaced, StopSignal stop) {
  if (std::ranges::all_of(replaced.pieces, &ReplacedBodies::Piece::keeps_vertices)) return;
  std::vector<SceneMotion::PartAfter> parts(topology_.part_count());
  std::vector<std::vector<double>> ordered;  // positions of new vertices, in new numbers
  ordered.reserve(new_parts_.size());
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    const FeatureRange& features = topology_.ranges()[p].features;
    parts[p] = {.first = features.first_vertex, .end = features.end_vertex};
  }
  PacedStop paced(stop);
  for (const TopologyReplacement::NewPart& from : new_parts_) {
    if (from.piece->keeps_vertices()) continue;
    const std::uint32_t p = from.piece->body;
    const std::vector<double> given = from.positions();
    std::vector<double>& in_order = ordered.emplace_back();
    in_order.reserve(given.size());
    for (const GivenVertex v : topology_.numbering_of(PartId{p}).given_vertices()) {
      paced.check();
      const auto x = given.begin() + std::ptrdiff_t{3} * number_of(v);
      in_order.insert(in_order.end(), x, x + 3);
    }
    parts[p].is_new = true;
    parts[p].kind = scene.bodies()[p].kind;
    parts[p].positions = in_order;
  }
  motion_ = core_.motion.replaced(parts, stop);
}

void CoreReplacement::make_orphans(StopSignal stop) {
  Topology& topology = *core_.topology;
  orphans_.resize(topology_.part_count());
  orphans_sum_ = core_.orphans_sum;
  for (std::uint32_t p = 0; p < topology_.part_count(); ++p) {
    const bool needed = model_.self_collision(PartId{p});
    const bool had = p < core_.orphans.size() && core_.orphans[p] != nullptr;
    if (!topology_.is_new(PartId{p}) && needed == had) continue;
    stop.check();
    if (had) orphans_sum_ -= orphans_checksum(topology.parts[p], p, stop);
    if (!needed) continue;
    if (topology_.is_new(PartId{p})) {
      orphans_sum_ += topology_.orphans_sum(PartId{p}, stop);
      orphans_[p] = std::make_unique<OrphanBlocks>(topology.scene, topology.parts[p].orphans,
                                                   topology_.orphans(PartId{p}));
    } else {
      topology.need_adjacent(PartId{p}, stop);
      orphans_sum_ += orphans_checksum(topology.parts[p], p, stop);
      orphans_[p] = std::make_unique<OrphanBlocks>(topology.scene, topology.parts[p].orphans);
    }
  }
}

void CoreReplacement::take(const Scene& scene) noexcept {
  topology_.take();
  if (motion_) core_.motion.take(*std::move(motion_));
  // Of what does not move they are not computed again.
  move_runs(core_.vertex_bounds, vertex_runs_, core_.topology->scene.vertex_count());
  core_.patch_culled = std::move(patch_culled_);
  for (std::uint32_t p = 0; p < changes_.size(); ++p) {
    if (!changes_[p].is_new) continue;
    if (changes_[p].keeps_vertices)
      core_.rigid_parts.forget_elements(PartId{p});
    else
      core_.rigid_parts.forget(PartId{p});
    core_.orphans[p].reset();
  }
  core_.take({std::move(model_), std::move(filter_), std::move(thickness_), std::move(worlds_),
              excluded_pairs_, std::move(orphans_), topology_checksum(scene, *core_.topology, {}),
              orphans_sum_});
}

}  // namespace warmfront
