// SPDX-License-Identifier: Apache-2.0
// Feature pairs that one fixed direction separates for the whole step do not meet. Pure function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/motion/motion.h"
#include "engine/narrow_phase/feature_block.h"

namespace warmfront {

/// Stage T1b over a block, several pairs at a time: keeps those of the `count` survivors that none of the
/// tried directions separates for the whole step, and returns their number. Removed pairs are certainly
/// apart; which are removed depends on the pair only. Requires no minimum separation. Source:
/// reference/algorithms 3.5, with the silhouette along the mean relative motion for the directions.
std::size_t separation_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                              std::uint16_t* survivors, std::size_t count);

}  // namespace warmfront
