// SPDX-License-Identifier: Apache-2.0
// A coarse set of a hierarchy's nodes, for a quick check that none of many nodes is of interest. Plain value.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "engine/bvh/tree_numbers.h"

namespace warmfront {

/// Stores nodes as the nodes of level 8 (256) that they are, lie below or lie above (on shallower levels as
/// if the tree continued). If two sets of one hierarchy are disjoint, no node of one equals, contains or lies
/// below a node of the other.
class NodeSet {
 public:
  void add(NodeId node) {
    const std::uint32_t from_one = number_of(node) + 1;
    const int level = std::bit_width(from_one) - 1;
    const std::uint32_t index = from_one - (1U << level);
    if (level >= kLevel) {
      const std::uint32_t bit = index >> (level - kLevel);
      words_[bit >> 6] |= std::uint64_t{1} << (bit & 63);
      return;
    }
    const std::uint32_t width = 1U << (kLevel - level);
    const std::uint32_t first = index * width;
    if (width < 64) {
      words_[first >> 6] |= ((std::uint64_t{1} << width) - 1) << (first & 63);
    } else {
      for (std::uint32_t word = first >> 6; word < (first + width) >> 6; ++word)
        words_[word] = ~std::uint64_t{0};
    }
  }

  bool meets(const NodeSet& other) const {
    std::uint64_t common = 0;
    for (std::size_t w = 0; w < words_.size(); ++w) common |= words_[w] & other.words_[w];
    return common != 0;
  }

 private:
  static constexpr int kLevel = 8;

  std::array<std::uint64_t, 4> words_{};
};

}  // namespace warmfront
