// SPDX-License-Identifier: Apache-2.0
#include "engine/step/patch_stage.h"

#include <algorithm>

#include "engine/bounds/normal_cone.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {

std::uint64_t cull_patches(Core& core, StopSignal stop) {
  const Scene& scene = core.topology->scene;
  const Patches& patches = core.topology->patches;
  constexpr std::size_t kAtOnce = 16;
  const auto cull = [&](std::size_t p) {
    const PartId part = core.motion.part_of(scene.faces()[patches.faces[p].front()][0]);
    core.patch_culled[p] =
        core.options.tier == Tier::kExact && core.options.min_separation == 0 && !core.thickness.any() &&
        core.options.pair_test == PairTest::kMotion && reports_by_distance(core.options) &&
        core.tests_itself(part) &&
        provably_embedded(scene, core.motion.vertices().vertices(), patches.faces[p], patches.contours[p]);
  };
  for_each_index(0, patches.count(), stop, cull, kAtOnce);
  return static_cast<std::uint64_t>(std::ranges::count(core.patch_culled, 1));
}

}  // namespace warmfront
