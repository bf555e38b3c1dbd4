// SPDX-License-Identifier: Apache-2.0
// Where the columns of an answer lie in memory that client and daemon share: SharedColumns in step.proto.
// Pure functions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace warmfront::wire {

/// Bits of SharedColumns.columns: the numbers of ContactColumns' fields, and what an answer has besides.
enum class SharedColumn : std::uint8_t {
  kKind = 1,
  kStatus = 2,
  kVertices = 3,
  kToi = 4,
  kWeights = 5,
  kNormal = 6,
  kPoints = 7,
  kSquaredDistance = 8,
  kClosest = 9,
  kDirection = 10,
  kMultiplicity = 11,
  kStencil = 12,
  kVertexDistances = 13,
  kWorlds = 14,
  kWorldTois = 15,
};

constexpr std::uint32_t bit_of(SharedColumn column) {
  return std::uint32_t{1} << static_cast<unsigned>(column);
}

/// Where a column begins behind what ends at `end`.
constexpr std::uint64_t column_begins(std::uint64_t end) {
  constexpr std::uint64_t kAlignment = 64;
  return (end + kAlignment - 1) / kAlignment * kAlignment;
}

/// The longest message that a packet of the socket of shared memory holds; see OnStream.
inline constexpr std::size_t kMostPacketBytes = 61'440;

/// What the path of that socket has behind the path of the daemon's address.
inline constexpr const char* kSharedMemorySuffix = ".shm";

}  // namespace warmfront::wire
