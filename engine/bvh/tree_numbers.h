// SPDX-License-Identifier: Apache-2.0
// The numbers of what a hierarchy has. TreeShape converts them into each other, and nobody else does.
#pragma once

#include <cstdint>

#include "engine/scene/numbers.h"

namespace warmfront {

/// A node, counted by levels from the root on.
enum class NodeId : std::uint32_t {};
template <>
inline constexpr bool kIsNumber<NodeId> = true;

inline constexpr NodeId kRoot{0};

/// A leaf, counted from the left.
enum class LeafId : std::uint32_t {};
template <>
inline constexpr bool kIsNumber<LeafId> = true;

/// A block of primitives, counted from the left.
enum class BlockId : std::uint32_t {};
template <>
inline constexpr bool kIsNumber<BlockId> = true;

}  // namespace warmfront
