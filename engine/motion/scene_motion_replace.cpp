// SPDX-License-Identifier: Apache-2.0
// The motion of a scene of which parts are replaced.
#include <utility>

#include "engine/motion/scene_motion.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

SceneMotion::Replacement SceneMotion::replaced(std::span<const PartAfter> parts, StopSignal stop) {
  const std::uint32_t vertex_count = parts.back().end;
  Replacement result;
  result.parts.reserve(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const auto& [is_new, kind, positions, first, end] = parts[p];
    stop.check();
    if (is_new) {
      const Motion& motion =
          result.vertices.emplace_back(Replacement::NewVertices{motion_.of_positions(positions, stop), first})
              .motion;
      Part& part = result.parts.emplace_back(stationary_part(motion, 0, end - first, kind, stop));
      part.first = first;
      part.end = end;
      if (kind != BodyKind::kRigid) continue;
      AtPose at{std::make_shared<const ReferenceShape>(motion.vertices(), motion.frame(), stop), {}};
      part.range.reach = part.reach_at_start = reach_at(part, *at.shape, at.pose);
      part.start = at;
      part.now = std::move(at);
    } else {
      Part& part = result.parts.emplace_back(parts_[p]);
      result.runs.push_back({part.first, part.end - part.first, first});
      for (std::uint32_t& vertex : part.range.changed) vertex += first - part.first;
      part.first = first;
      part.end = end;
    }
  }
  lengthen(result.named, vertex_count, std::uint8_t{0}, stop);
  result.given.resize(parts.size());
  motion_.make_room(vertex_count, stop);
  return result;
}

void SceneMotion::take(Replacement replacement) noexcept {
  parts_ = std::move(replacement.parts);
  motion_.splice(replacement.runs, parts_.back().end);
  for (const auto& [motion, first] : replacement.vertices) motion_.take(motion, first);
  named_ = std::move(replacement.named);
  given_ = std::move(replacement.given);
  take_magnitude();
}

}  // namespace warmfront
