// SPDX-License-Identifier: Apache-2.0
// Which parts of a scene are near each other: a small hierarchy over the parts' own. Used by one thread at a
// time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/front/segment.h"
#include "engine/scene/collision_model.h"

namespace warmfront {

template <class Bounds>
class NearParts {
 public:
  /// The parts' bounds in this step, and which of them are other than in the last. The pairs that may meet
  /// and overlap, sorted, parts that are tested against themselves with themselves among them; valid until
  /// the next call. Pairs of which neither part changed are taken from the last step, unless `anew`. Adds its
  /// overlap tests to `bv_tests`.
  std::span<const NearPair> find(const CollisionModel& model, std::span<const Bounds> roots,
                                 std::span<const std::uint8_t> changed, bool anew, std::uint64_t& bv_tests);

  std::size_t memory_bytes() const {
    return near_.capacity() * sizeof(NearPair) + nodes_.size() * (sizeof(Node) + sizeof(std::uint32_t));
  }

 private:
  struct Node {
    Bounds bounds;
    CollisionModel::Set set;
    bool changed;
  };

  void arrange(const CollisionModel& model, std::span<const Bounds> roots);
  void order(const CollisionModel& model, std::span<const Bounds> roots, NodeId node);
  void refit(const CollisionModel& model, std::span<const Bounds> roots,
             std::span<const std::uint8_t> changed);
  double looseness() const;

  TreeShape shape_;
  std::vector<std::uint32_t> order_;  // part by position
  std::vector<Node> nodes_;
  double built_looseness_ = 0;
  std::vector<NearPair> near_;
  std::vector<NearPair> last_;
};

}  // namespace warmfront
