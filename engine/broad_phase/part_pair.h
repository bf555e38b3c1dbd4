// SPDX-License-Identifier: Apache-2.0
// Pairs of parts. Plain values.
#pragma once

#include <compare>

#include "engine/scene/part_id.h"

namespace warmfront {

/// Two parts of a scene, a <= b; a part against itself (a == b).
struct PartPair {
  PartId a;
  PartId b;
  friend auto operator<=>(const PartPair&, const PartPair&) = default;
};

/// Two parts that are near each other, or one part that is tested against itself.
struct NearPair {
  PartPair parts;
  /// Neither part changed: the cached results between them hold.
  bool rests = false;
};

}  // namespace warmfront
