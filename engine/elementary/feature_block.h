// SPDX-License-Identifier: Apache-2.0
// A block of feature pairs on their way through the elementary cascade. Used by one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/contact.h"
#include "engine/motion/motion.h"

namespace warmfront {

struct FeaturePair {
  std::array<std::uint32_t, 4> vertices;  ///< vertex, face's three; or edge's two, edge's two
  std::uint32_t a;                        ///< vertex or edge
  std::uint32_t b;                        ///< face or edge
  ContactKind kind;
};

/// Candidates are never materialised whole: they are tested a block at a time.
struct FeatureBlock {
  static constexpr std::size_t kCapacity = 512;
  std::array<FeaturePair, kCapacity> pairs;
  std::size_t size = 0;

  bool full() const { return size == kCapacity; }
  void push(const FeaturePair& pair) { pairs[size++] = pair; }
};

/// Stage T1 over a block, several pairs at a time: writes to `survivors` (room for pairs.size()) the indices,
/// ascending, of the pairs whose coplanarity cubic may vanish (widened by the separation), and returns how
/// many. All coefficients certainly of one sign: no contact. Same bound as Cubic, on unscaled coordinates:
/// where they would overflow or underflow the pair survives. Answers are the same on every instruction set.
std::size_t coplanarity_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                               double min_separation, std::uint16_t* survivors);

/// Stage T1b over a block, several pairs at a time: keeps those of the `count` survivors that no direction
/// tried keeps apart for the whole step, and returns how many. What goes is apart for certain; which goes
/// depends on the pair alone. No minimum separation. Source: reference/algorithms 3.5, with the silhouette
/// along the mean relative motion for the directions.
std::size_t separation_filter(std::span<const FeaturePair> pairs, std::span<const VertexMotion> vertices,
                              std::uint16_t* survivors, std::size_t count);

}  // namespace warmfront
