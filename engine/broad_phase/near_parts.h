// SPDX-License-Identifier: Apache-2.0
// Which parts of a scene are near each other: a small hierarchy over the parts' own. Used by one thread at a
// time, inside Workers::run().
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/broad_phase/part_pair.h"
#include "engine/bvh/bvtt.h"
#include "engine/scene/collision_model.h"
#include "engine/scene/held_bytes.h"
#include "engine/stop.h"

namespace warmfront {

template <class Bounds>
class NearParts {
 public:
  /// Takes the parts' bounds in this step, and which changed since the last one. Returns the pairs that may
  /// meet and overlap, sorted, including self-tested parts with themselves; valid until the next call. Pairs
  /// of which neither part changed are taken from the last step, unless `rebuild`. Adds its overlap tests to
  /// `bv_tests`. Throws Stopped when told to stop; the next find() must then be `rebuild`.
  ///
  /// With more than `most` pairs of two parts it returns none, overflowed() is true, and next_block() returns
  /// them block by block; the next find() must be `rebuild`.
  std::span<const NearPair> find(const CollisionModel& model, std::span<const Bounds> roots,
                                 std::span<const std::uint8_t> changed, bool rebuild, std::uint64_t& bv_tests,
                                 std::size_t most = ~std::size_t{0}, StopSignal stop = {});

  bool overflowed() const { return overflowed_; }
  /// After a find() that overflowed, in the same step: the next block of about kBlock pairs, sorted; each
  /// pair occurs in one block. Empty when there are no more. Valid until the next call.
  std::span<const NearPair> next_block(const CollisionModel& model, std::span<const std::uint8_t> changed,
                                       std::uint64_t& bv_tests, StopSignal stop);
  static constexpr std::size_t kBlock = std::size_t{1} << 16;

  std::size_t memory_bytes() const;

 private:
  struct Node {
    Bounds bounds;
    CollisionModel::Set set;
    bool changed;
  };

  /// What a traversal goes by.
  struct Parts {
    const CollisionModel& model;
    std::span<const std::uint8_t> changed;
    bool rebuild;
  };
  /// What a traversal finds.
  struct Found {
    std::vector<NearPair> near;
    std::uint64_t bv_tests = 0;
  };
  /// A part of it, which one task takes.
  struct Task {
    std::vector<NodePair> stack;
    Found found;
  };

  void arrange(const CollisionModel& model, std::span<const Bounds> roots, StopSignal stop);
  void order(const CollisionModel& model, std::span<const Bounds> roots, NodeId node, StopSignal stop);
  void refit(const CollisionModel& model, std::span<const Bounds> roots,
             std::span<const std::uint8_t> changed);
  void refit(NodeId node, const CollisionModel& model, std::span<const Bounds> roots,
             std::span<const std::uint8_t> changed);
  double looseness() const;
  /// Tests a pair: it has children and is appended to `next`, or parts that are near, or neither.
  void look(const Parts& parts, const NodePair& pair, std::vector<NodePair>& next, Found& found) const;
  void look_at_children(const Parts& parts, const NodePair& pair, std::vector<NodePair>& next,
                        Found& found) const;
  /// Continues from `stack` until it is empty, or `enough(found)`.
  template <class Enough>
  void traverse(const Parts& parts, std::vector<NodePair>& stack, Found& found, StopSignal stop,
                const Enough& enough) const;
  /// All of it, in tasks where there is enough for them, or until there are more than `most` near pairs.
  void traverse_all(const Parts& parts, std::size_t most, StopSignal stop);
  void sort(StopSignal stop);

  TreeShape shape_;
  std::vector<PartId> order_;  // part by position
  std::vector<Node> nodes_;
  double built_looseness_ = 0;
  Found found_;
  std::vector<NearPair> last_;
  std::vector<NodePair> stack_;  // whose children are not yet looked at
  std::vector<NodePair> level_;  // for traverse_all() alone
  std::vector<Task> tasks_;
  std::size_t next_self_ = 0;    // index in `order_` of the next part against itself for next_block()
  bool overflowed_ = false;
};

}  // namespace warmfront
