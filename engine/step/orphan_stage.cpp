// SPDX-License-Identifier: Apache-2.0
#include "engine/step/orphan_stage.h"

namespace warmfront {

void OrphanStage::take_parts(Core& core) {
  parts_.clear();
  for (std::uint32_t p = 0; p < core.orphans.size(); ++p) {
    if (core.orphans[p] == nullptr) continue;
    if (core.rigid_parts.rigid(p)) {
      core.orphans[p]->forget();
      continue;
    }
    core.orphans[p]->range = &core.motion.range(p);
    parts_.push_back(core.orphans[p].get());
  }
}

void OrphanStage::take_edges(const Core& core) {
  edges_.clear();
  for (std::uint32_t p = 0; p < core.topology->parts.size(); ++p) {
    if (!core.model.is_removed(p) && core.tests_itself(p)) edges_.push_back(core.topology->parts[p].features);
  }
}

void OrphanStage::forget_answers(Core& core) noexcept {
  for (const auto& orphans : core.orphans) {
    if (orphans != nullptr) orphans->forget();
  }
}

}  // namespace warmfront
