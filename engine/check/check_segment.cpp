// SPDX-License-Identifier: Apache-2.0
#include "engine/check/check_segment.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace warmfront {
namespace {

// Two nodes of at most 31 levels, with two pending siblings at each.
constexpr std::size_t kDeepest = 192;

std::string text(const NodePair& pair) {
  std::string words("(");
  words.append(std::to_string(number_of(pair.a))).append(", ");
  return words.append(std::to_string(number_of(pair.b))).append(")");
}

}  // namespace

// A depth-first walk of the test tree meets the front's pairs in order: each path from the root ends at one
// of them.
template <class Bounds>
std::string broken_cut(const FrontSegment& segment, const TreePair<Bounds>& trees) {
  const Bvtt bvtt = trees.bvtt();
  std::size_t pairs = 0;
  std::vector<NodePair> stack{Bvtt::root()};
  for (const FrontChunk& chunk : segment.chunks) {
    pairs += chunk.pairs.size();
    for (const FrontPair& pair : chunk.pairs) {
      for (;;) {
        if (stack.empty() || stack.size() > kDeepest) return "has pair " + text(pair.nodes) + " out of place";
        const NodePair at = stack.back();
        stack.pop_back();
        if (at == pair.nodes) break;
        if (bvtt.is_leaf(at)) return "lacks pair " + text(at);
        const auto children = static_cast<std::ptrdiff_t>(stack.size());
        bvtt.for_children(at, [&](const NodePair& child) { stack.push_back(child); });
        std::reverse(stack.begin() + children, stack.end());
      }
    }
  }
  if (!stack.empty()) return "has no pairs below " + text(stack.back());
  if (pairs != segment.size) return "has a wrong pair count";
  return "";
}

template <class Bounds>
std::string broken_chunk(const FrontChunk& chunk, const TreePair<Bounds>& trees) {
  const Bvtt bvtt = trees.bvtt();
  std::uint64_t tests = 0;
  for (const FrontPair& pair : chunk.pairs) {
    if (!bvtt.is_leaf(pair.nodes) && !(trees.gap(pair.nodes, tests) > 0))
      return "marks overlapping pair " + text(pair.nodes) + " as disjoint";
    if (pair.adjacent && trees.gap(pair.nodes, tests) > 0)
      return "marks pair " + text(pair.nodes) + " as adjacent";
  }
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < chunk.kept.pairs.size(); ++i) {
    contacts += chunk.kept.pairs[i].contacts;
    if (chunk.kept.pairs[i].pair >= chunk.pairs.size() ||
        (i > 0 && chunk.kept.pairs[i].pair <= chunk.kept.pairs[i - 1].pair))
      return "caches answers of pairs that it does not contain";
  }
  if (contacts != chunk.kept.contacts.size()) return "has a wrong count of cached contacts";
  return "";
}

template std::string broken_cut(const FrontSegment&, const TreePair<Aabb>&);
template std::string broken_cut(const FrontSegment&, const TreePair<KDop18>&);
template std::string broken_chunk(const FrontChunk&, const TreePair<Aabb>&);
template std::string broken_chunk(const FrontChunk&, const TreePair<KDop18>&);

}  // namespace warmfront
