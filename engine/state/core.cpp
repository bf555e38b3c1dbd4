// SPDX-License-Identifier: Apache-2.0
#include "engine/state/core.h"

#include <utility>

#include "engine/bvh/topology_checksum.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

std::vector<double> to_doubles(const Positions& positions, StopSignal stop) {
  std::vector<double> values;
  std::visit(
      [&](auto span) {
        values.reserve(span.size());
        in_pieces(0, span.size(), stop, [&](std::size_t first, std::size_t end) {
          values.insert(values.end(), span.begin() + static_cast<std::ptrdiff_t>(first),
                        span.begin() + static_cast<std::ptrdiff_t>(end));
        });
      },
      positions);
  return values;
}

namespace {

std::vector<FeatureRange> ranges_of(const Topology& topology) {
  std::vector<FeatureRange> ranges;
  ranges.reserve(topology.parts.size());
  for (const PartTopology& part : topology.parts) ranges.push_back(part.features);
  return ranges;
}

}  // namespace

Core::Core(std::shared_ptr<const Scene> the_scene, const Scene& modelled, const Positions& positions,
           const ColliderOptions& the_options, std::shared_ptr<Workers> the_workers, StopSignal stop)
    : scene(std::move(the_scene)),
      options(the_options),
      asked_separation(the_options.min_separation),
      workers(std::move(the_workers)),
      motion(modelled, to_doubles(positions, stop), stop),
      model(modelled, stop) {
  // The cone theorem rules out meeting, not what other tiers report: what is near, or seems to meet.
  const bool cones = options.normal_cones && options.tier == Tier::kExact && options.min_separation == 0 &&
                     scene->most_thickness() == 0;
  workers->run([&] {
    topology = std::make_unique<Topology>(modelled, motion.vertices(), options.leaf_size, cones, stop);
    motion.renumber(topology->numbering, 0, stop);
    take(make_parts(modelled, *scene, true, stop));
  });
}

Core::Parts Core::make_parts(const Scene& modelled, const Scene& given, bool extended, StopSignal stop) {
  Parts parts{CollisionModel(modelled, stop), {}, {}, Worlds(given, stop), 0, {}, topology_sum, orphans_sum};
  parts.filter = make_filter(given.filters(), parts.model, stop);
  parts.thickness = make_thickness(given, ranges_of(*topology), topology->numbering, stop);
  if (extended) parts.topology_sum = topology_checksum(given, *topology, stop);
  parts.excluded_pairs = parts.model.excluded_pairs(stop);
  // Room that is not needed after all does no harm.
  rigid_parts.make_room(parts.model);
  lengthen(vertex_bounds, topology->scene.vertex_count(), PointBounds{}, stop);
  patch_culled.resize(topology->patches.count());
  orphans.resize(topology->parts.size());
  parts.orphans.resize(topology->parts.size());
  for (std::uint32_t p = 0; p < parts.orphans.size(); ++p) {
    const bool needed = parts.model.self_collision(PartId{p});
    if (needed == (orphans[p] != nullptr)) continue;
    stop.check();
    if (!needed) {
      parts.orphans_sum -= orphans_checksum(topology->parts[p], p, stop);
      continue;
    }
    topology->need_adjacent(PartId{p}, stop);
    parts.orphans_sum += orphans_checksum(topology->parts[p], p, stop);
    parts.orphans[p] = std::make_unique<OrphanBlocks>(topology->scene, topology->parts[p].orphans);
  }
  return parts;
}

PairFilter Core::make_filter(const PairFilters& filters, const CollisionModel& of_parts,
                             StopSignal stop) const {
  return make_filter(filters, of_parts, ranges_of(*topology), topology->numbering, topology->scene, stop);
}

PairFilter Core::make_filter(const PairFilters& filters, const CollisionModel& of_parts,
                             std::span<const FeatureRange> ranges, const Renumbering& numbering,
                             const Scene& renumbered, StopSignal stop) {
  if (!filters.any()) return {};
  std::vector<FeatureRange> themselves;
  for (std::uint32_t p = 0; p < ranges.size(); ++p) {
    if (of_parts.self_collision(PartId{p})) themselves.push_back(ranges[p]);
  }
  PairFilter filter(filters, themselves, numbering, renumbered, stop);
  filter.set_built_sum(filter_checksum(filter, stop));
  return filter;
}

Thickness Core::make_thickness(const Scene& given, std::span<const FeatureRange> ranges,
                               const Renumbering& numbering, StopSignal stop) {
  Thickness made(given, ranges, numbering, stop);
  made.set_built_sum(thickness_checksum(made, stop));
  return made;
}

void Core::take(Parts parts) noexcept {
  model = std::move(parts.model);
  filter = std::move(parts.filter);
  thickness = std::move(parts.thickness);
  worlds = std::move(parts.worlds);
  rigid_parts.take(model);
  excluded_pairs = parts.excluded_pairs;
  for (std::uint32_t p = 0; p < orphans.size(); ++p) {
    if (!model.self_collision(PartId{p})) {
      orphans[p].reset();
    } else if (orphans[p] == nullptr) {
      orphans[p] = std::move(parts.orphans[p]);
    }
  }
  topology_sum = parts.topology_sum;
  orphans_sum = parts.orphans_sum;
}

std::size_t Core::memory_bytes() const {
  // A part has some thirty small allocations in all rooms, each of which the allocator rounds up.
  constexpr std::size_t kRoundedUp = 512;
  std::size_t bytes =
      scene->memory_bytes() + topology->memory_bytes() + motion.memory_bytes() +
      vertex_bounds.capacity() * sizeof(PointBounds) + met.memory_bytes() + near.memory_bytes() +
      rigid_parts.memory_bytes() + model.memory_bytes() + filter.memory_bytes() + thickness.memory_bytes() +
      arcs.memory_bytes() + room.memory_bytes() + window.memory_bytes() + worlds.memory_bytes() +
      orphans.capacity() * sizeof(orphans[0]) + patch_culled.capacity() + topology->parts.size() * kRoundedUp;
  for (const auto& of_part : orphans) {
    if (of_part != nullptr) bytes += of_part->memory_bytes();
  }
  return bytes;
}

}  // namespace warmfront
