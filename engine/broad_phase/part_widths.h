// SPDX-License-Identifier: Apache-2.0
// Within which widths the bounds of two parts count as near each other, in one question. Plain values;
// `thickness` and
// `arcs` must outlive them.
#pragma once

#include "engine/bounds/width.h"
#include "engine/broad_phase/part_pair.h"
#include "engine/motion/arcs.h"
#include "engine/motion/motion.h"
#include "engine/scene/thickness.h"

namespace warmfront {

/// One width for all pairs where nothing is thick and nothing moves along an arc. Else each pair of parts has
/// its own, by the thickest vertex and the longest arc of either: so a thick body costs what is near it
/// something, and nothing else.
class PartWidths {
 public:
  PartWidths(const Width& of_all = {}) : of_all_(of_all) {}  // NOLINT: implicit by design
  /// `separation`, of the question, in scene units.
  PartWidths(double separation, const Thickness& thickness, const Arcs& arcs, const LocalTransform& frame)
      : of_all_(Width::of(frame.to_local(separation))),
        separation_(separation),
        thickness_(thickness.any() ? &thickness : nullptr),
        arcs_(arcs.any() ? &arcs : nullptr),
        frame_(frame) {}

  Width of(const PartPair& parts) const {
    if (alike()) return of_all_;
    double separation = separation_;
    if (thickness_ != nullptr) separation = thickness_->between(separation, parts.a, parts.b);
    if (arcs_ != nullptr) separation = arcs_->widened(separation, parts.a, parts.b);
    return Width::of(frame_.to_local(separation));
  }
  /// The width of a separation, of no parts, where that is less than `most`. Not where vertices move along
  /// arcs.
  Width narrowed(double separation, const Width& most) const {
    const double local = frame_.to_local(separation);
    return local < most.straight ? Width::of(local) : most;
  }
  /// Of the parts that two vertices are in.
  Width around(std::uint32_t vertex_a, std::uint32_t vertex_b) const {
    if (alike()) return of_all_;
    if (arcs_ != nullptr) return of({arcs_->part_around(vertex_a), arcs_->part_around(vertex_b)});
    return of({thickness_->part_around(vertex_a), thickness_->part_around(vertex_b)});
  }

 private:
  bool alike() const { return thickness_ == nullptr && arcs_ == nullptr; }

  Width of_all_;
  double separation_ = 0;
  const Thickness* thickness_ = nullptr;
  const Arcs* arcs_ = nullptr;
  LocalTransform frame_;
};

}  // namespace warmfront
