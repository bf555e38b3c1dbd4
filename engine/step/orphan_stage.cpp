// SPDX-License-Identifier: Apache-2.0
#include "engine/step/orphan_stage.h"

namespace warmfront {

void OrphanStage::take_parts(Core& core) {
  parts_.clear();
  for (std::uint32_t p = 0; p < core.orphans.size(); ++p) {
    if (core.orphans[p] == nullptr) continue;
    if (core.rigid_parts.rigid(PartId{p})) {
      core.orphans[p]->forget();
      continue;
    }
    core.orphans[p]->range = &core.motion.range(PartId{p});
    parts_.push_back(core.orphans[p].get());
  }
}

std::span<const PartId> OrphanStage::take_edge_faces(const Core& core, StopSignal stop) {
  edge_faces_.resize(core.topology->parts.size());
  testing_.clear();
  for (std::uint32_t p = 0; p < edge_faces_.size(); ++p) {
    if (core.model.is_removed(PartId{p}) || !core.tests_itself(PartId{p})) continue;
    testing_.push_back(PartId{p});
    if (edge_faces_[p].known) continue;
    edge_faces_[p].orphans = edge_face_orphans(core.topology->scene, core.topology->parts[p].features, stop);
    edge_faces_[p].known = true;
  }
  return testing_;
}

std::size_t OrphanStage::memory_bytes() const {
  std::size_t bytes = held_bytes(parts_, edge_faces_, testing_);
  for (const EdgeFaces& part : edge_faces_) bytes += held_bytes(part.orphans);
  return bytes;
}

void OrphanStage::forget_answers(Core& core) noexcept {
  for (const auto& orphans : core.orphans) {
    if (orphans != nullptr) orphans->forget();
  }
}

}  // namespace warmfront
