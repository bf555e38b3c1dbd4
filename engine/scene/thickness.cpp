// SPDX-License-Identifier: Apache-2.0
#include "engine/scene/thickness.h"

#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

Thickness::Thickness(const Scene& given, std::span<const FeatureRange> parts, const Renumbering& numbering,
                     StopSignal stop) {
  if (given.most_thickness() == 0) return;
  lengthen(of_vertex_, given.vertex_count(), 0.0, stop);
  for_each_index(0, given.vertex_count(), stop, [&](std::size_t v) {
    const auto vertex = static_cast<std::uint32_t>(v);
    of_vertex_[v] = given.thickness_of(number_of(numbering.given(NewVertex{vertex})));
  });
  reserve(part_of_vertex_, given.vertex_count(), stop);
  of_part_.reserve(parts.size());
  PacedStop paced(stop);
  for (const FeatureRange& part : parts) {
    double most = 0;
    const std::size_t body = of_part_.size();
    if (body < given.bodies().size() && given.bodies()[body].half_space &&
        given.bodies()[body].kind != BodyKind::kRemoved)
      most = given.bodies()[body].thickness;
    for (std::uint32_t v = part.first_vertex; v < part.end_vertex; ++v) {
      paced.check();
      most = std::max(most, of_vertex_[v]);
      part_of_vertex_.push_back(PartId{static_cast<std::uint32_t>(of_part_.size())});
    }
    of_part_.push_back(most);
    most_ = std::max(most_, most);
  }
}

Status check_thickness(double most, const ColliderOptions& options) {
  if (most == 0) return {};
  if (options.tier == Tier::kFast)
    return invalid_argument(
        "thickness: tier \"fast\" decides touching; with thick vertices use tier \"certified\" or \"exact\"");
  if (options.min_separation > 0x1p1022)
    return invalid_argument(
        "min_separation: is more than 2^1022, to which the scene's thickness cannot be added");
  return {};
}

}  // namespace warmfront
