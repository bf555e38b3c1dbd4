// SPDX-License-Identifier: Apache-2.0
// The orphan sets of a part in blocks, with cached contacts of the stationary ones. A block is tested by one
// thread at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/motion/motion.h"
#include "engine/scene/orphans.h"

namespace warmfront {

class PairTester;

class OrphanBlocks {
 public:
  /// `orphans` and `scene` must outlive this at the same address.
  OrphanBlocks(const Scene& scene, const Orphans& orphans) : OrphanBlocks(scene, orphans, orphans) {}
  /// The same of orphans that will be there when they are tested: as many as `made`.
  OrphanBlocks(const Scene& scene, const Orphans& orphans, const Orphans& made);

  std::size_t count() const { return blocks_.size(); }
  /// Tests a block in this step: the motion of all of the part's vertices is `range`. Orphans that have not
  /// changed since their last test keep their result, unless `retest`.
  void test(std::size_t block, const RangeMotion& range, std::span<const MotionState> states, bool retest,
            PairTester& tester);

  /// Drops the results of a step that was rolled back.
  void forget();

  std::size_t memory_bytes() const;

  /// Motion of the part in this step.
  const RangeMotion* range = nullptr;

 private:
  static constexpr std::size_t kOrphans = 64;

  struct Kept {
    std::uint32_t orphan;  ///< vertex-face pairs first
    Contact contact;
  };
  struct Block {
    std::vector<Kept> kept;  ///< ascending
    bool tested = false;     ///< in an earlier step
  };

  MotionState state_of(std::uint32_t orphan, std::span<const MotionState> states) const;

  const Scene& scene_;
  const Orphans& orphans_;
  std::vector<Block> blocks_;
};

}  // namespace warmfront
