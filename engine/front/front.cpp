// SPDX-License-Identifier: Apache-2.0
// The front's storage: chunks of about equal size, in order.
#include "engine/front/front.h"

#include <algorithm>
#include <iterator>

#include "engine/front/chunk_update.h"

namespace warmfront {

template <class Bounds>
void Front<Bounds>::begin(std::size_t max_bytes) {
  for (Scratch& scratch : scratch_) scratch.counts = {};
  recorded_.store(0, std::memory_order_relaxed);
  max_pairs_ = max_bytes / sizeof(FrontPair);
  overflowed_ = false;
}

template <class Bounds>
void Front<Bounds>::finish() {
  counts_ = {};
  for (const Scratch& scratch : scratch_) {
    counts_.bv_tests += scratch.counts.bv_tests;
    counts_.skipped += scratch.counts.skipped;
    counts_.sprouted += scratch.counts.sprouted;
    counts_.pruned += scratch.counts.pruned;
  }
  size_ = recorded_.load(std::memory_order_relaxed);
  overflowed_ = size_ > max_pairs_;
  if (overflowed_) {
    clear();
  } else {
    rebalance();
  }
}

template <class Bounds>
void Front<Bounds>::store(const Chunk& pairs, Chunk& chunk) {
  if (recorded_.fetch_add(pairs.size(), std::memory_order_relaxed) + pairs.size() > max_pairs_) return;
  chunk.assign(pairs.begin(), pairs.end());
}

// Chunks are the unit of work, so none may be much larger than the others, and few much smaller. Chunks that
// are left as they are only change hands.
template <class Bounds>
void Front<Bounds>::rebalance() {
  constexpr std::size_t kPairs = ChunkUpdate<Bounds>::kPairs;
  const auto too_large = [](const Chunk& chunk) { return chunk.size() > 2 * kPairs; };
  if (chunks_.size() < 4 + 4 * (size_ / kPairs) && std::ranges::none_of(chunks_, too_large)) return;
  std::vector<Chunk> balanced;
  balanced.reserve(size_ / (kPairs / 2) + 1);
  for (Chunk& chunk : chunks_) {
    if (too_large(chunk)) {
      for (std::size_t i = 0; i < chunk.size(); i += kPairs) {
        const auto first = chunk.begin() + static_cast<std::ptrdiff_t>(i);
        balanced.emplace_back(first, first + static_cast<std::ptrdiff_t>(std::min(kPairs, chunk.size() - i)));
      }
    } else if (!balanced.empty() && balanced.back().size() + chunk.size() <= kPairs) {
      balanced.back().insert(balanced.back().end(), chunk.begin(), chunk.end());
    } else if (!chunk.empty()) {
      balanced.push_back(std::move(chunk));
    }
  }
  chunks_ = std::move(balanced);
}

template <class Bounds>
void Front<Bounds>::clear() {
  chunks_ = {};
  scratch_.clear();
  size_ = 0;
}

template <class Bounds>
std::vector<NodePair> Front<Bounds>::pairs() const {
  std::vector<NodePair> pairs;
  pairs.reserve(size_);
  for (const Chunk& chunk : chunks_)
    std::ranges::transform(chunk, std::back_inserter(pairs), &FrontPair::nodes);
  return pairs;
}

template <class Bounds>
std::size_t Front<Bounds>::pair_bytes() const {
  std::size_t bytes = chunks_.capacity() * sizeof(Chunk);
  for (const Chunk& chunk : chunks_) bytes += chunk.capacity() * sizeof(FrontPair);
  return bytes;
}

template <class Bounds>
std::size_t Front<Bounds>::memory_bytes() const {
  std::size_t bytes = pair_bytes();
  for (const Scratch& scratch : scratch_) bytes += scratch.pairs.capacity() * sizeof(FrontPair);
  return bytes;
}

template class Front<Aabb>;
template class Front<KDop18>;

}  // namespace warmfront
