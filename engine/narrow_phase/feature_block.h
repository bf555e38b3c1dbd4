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

/// Empties a block when it goes, also where testing its pairs throws: the thread may go on with other tasks
/// of the step until all have heard of it, and these push theirs.
class EmptiedBlock {
 public:
  explicit EmptiedBlock(FeatureBlock& block) : block_(block) {}
  ~EmptiedBlock() { block_.size = 0; }
  EmptiedBlock(const EmptiedBlock&) = delete;
  EmptiedBlock& operator=(const EmptiedBlock&) = delete;

 private:
  FeatureBlock& block_;
};

}  // namespace warmfront
