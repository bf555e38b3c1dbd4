// SPDX-License-Identifier: Apache-2.0
// The motion of a scene of which parts are replaced.
#include <utility>

#include "engine/motion/scene_motion.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

SceneMotion::Replacement SceneMotion::replaced(std::span<const PartAfter> parts, StopSignal stop) const {
  const std::uint32_t vertex_count = parts.back().end;
  Replacement result(motion_.without_vertices(vertex_count, stop));
  Motion& motion = result.motion;
  result.parts.reserve(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const auto& [is_new, kind, positions, first, end] = parts[p];
    stop.check();
    if (is_new) {
      motion.append(positions, stop);
      Part& part = result.parts.emplace_back(stationary_part(motion, first, end, kind, stop));
      if (kind != BodyKind::kRigid) continue;
      AtPose at{std::make_shared<const ReferenceShape>(motion.vertices().subspan(first, end - first),
                                                       motion.frame(), stop),
                {}};
      part.range.reach = part.reach_at_start = reach_at(*at.shape, at.pose);
      part.start = at;
      part.now = std::move(at);
    } else {
      motion.append(motion_, parts_[p].first, parts_[p].end, stop);
      Part& part = result.parts.emplace_back(parts_[p]);
      for (std::uint32_t& vertex : part.range.changed) vertex += first - part.first;
      part.first = first;
      part.end = end;
    }
  }
  lengthen(result.named, vertex_count, std::uint8_t{0}, stop);
  result.given.resize(parts.size());
  return result;
}

void SceneMotion::take(Replacement replacement) noexcept {
  motion_ = std::move(replacement.motion);
  parts_ = std::move(replacement.parts);
  named_ = std::move(replacement.named);
  given_ = std::move(replacement.given);
  take_magnitude();
}

}  // namespace warmfront
