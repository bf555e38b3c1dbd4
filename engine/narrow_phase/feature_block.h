// SPDX-License-Identifier: Apache-2.0
// A block of feature pairs for the elementary cascade. Used by one thread at a time.
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

/// Candidates are never stored all at once: they are tested a block at a time.
struct FeatureBlock {
  static constexpr std::size_t kCapacity = 512;
  std::array<FeaturePair, kCapacity> pairs;
  std::size_t size = 0;

  bool full() const { return size == kCapacity; }
  void push(const FeaturePair& pair) { pairs[size++] = pair; }
};

}  // namespace warmfront
