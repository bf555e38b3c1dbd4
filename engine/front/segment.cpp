// SPDX-License-Identifier: Apache-2.0
#include "engine/front/segment.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace warmfront {

void rebalance(FrontSegment& segment) {
  constexpr std::size_t kPairs = FrontChunk::kPairs;
  auto& chunks = segment.chunks;
  const auto too_large = [](const FrontChunk& chunk) { return chunk.pairs.size() > 2 * kPairs; };
  if (chunks.size() < 4 + 4 * (segment.size / kPairs) && std::ranges::none_of(chunks, too_large)) return;
  std::vector<FrontChunk> balanced;
  balanced.reserve(segment.size / (kPairs / 2) + 1);
  const auto append = [&](const FrontChunk& from, std::size_t begin, std::size_t end, FrontChunk& to) {
    const auto shift = static_cast<std::uint32_t>(to.pairs.size() - begin);  // modulo 2^32
    to.pairs.insert(to.pairs.end(), from.pairs.begin() + static_cast<std::ptrdiff_t>(begin),
                    from.pairs.begin() + static_cast<std::ptrdiff_t>(end));
    auto contacts = from.kept.contacts.begin();
    for (const KeptAnswers::OfPair& kept : from.kept.pairs) {
      const auto next = contacts + kept.contacts;
      if (kept.pair >= begin && kept.pair < end) {
        to.kept.pairs.push_back({kept.pair + shift, kept.triangle_pairs, kept.contacts, kept.tally});
        to.kept.contacts.insert(to.kept.contacts.end(), contacts, next);
      }
      contacts = next;
    }
    to.find_nodes();
  };
  for (FrontChunk& chunk : chunks) {
    if (too_large(chunk)) {
      for (std::size_t i = 0; i < chunk.pairs.size(); i += kPairs)
        append(chunk, i, std::min(i + kPairs, chunk.pairs.size()), balanced.emplace_back());
    } else if (!balanced.empty() && balanced.back().pairs.size() + chunk.pairs.size() <= kPairs) {
      append(chunk, 0, chunk.pairs.size(), balanced.back());
    } else if (!chunk.pairs.empty()) {
      balanced.push_back(std::move(chunk));
    }
  }
  chunks = std::move(balanced);
}

}  // namespace warmfront
