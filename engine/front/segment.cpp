// SPDX-License-Identifier: Apache-2.0
#include "engine/front/segment.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

#include "engine/parallel/join_pieces.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

bool too_large(const FrontChunk& chunk) {
  return chunk.pairs.size() > 2 * FrontChunk::kPairs;
}

/// What new chunks are made of: each of some runs of old ones' pairs.
struct Division {
  struct Run {
    std::size_t chunk;
    std::size_t begin;  // of its pairs
    std::size_t end;
    std::size_t of;  // so many
  };
  std::vector<Run> runs;
  std::vector<std::size_t> first_runs;  // by new chunk, and where they end

  explicit Division(const FrontSegment& segment) {
    constexpr std::size_t kPairs = FrontChunk::kPairs;
    runs.reserve(segment.chunks.size() + segment.size / kPairs);
    first_runs.reserve(segment.size / (kPairs / 2) + 2);
    std::size_t last = kPairs;  // so many pairs has the last new chunk
    for (std::size_t c = 0; c < segment.chunks.size(); ++c) {
      const std::size_t size = segment.chunks[c].pairs.size();
      const std::size_t most = too_large(segment.chunks[c]) ? kPairs : size;
      for (std::size_t begin = 0; begin < size; begin += most) {
        const std::size_t end = std::min(begin + most, size);
        const bool joins = most == size && last + size <= kPairs;
        if (!joins) first_runs.push_back(runs.size());
        last = (joins ? last : 0) + end - begin;
        runs.push_back({c, begin, end, size});
      }
    }
    first_runs.push_back(runs.size());
  }
};

// What new chunks cost, about: their share of the old ones, by pairs.
std::vector<std::uint32_t> costs_after(const Division& division, const FrontSegment& before) {
  if (before.costs.empty()) return {};
  std::vector<std::uint32_t> costs;
  costs.reserve(division.first_runs.size() - 1);
  for (std::size_t c = 0; c + 1 < division.first_runs.size(); ++c) {
    std::uint64_t cost = 0;
    for (std::size_t r = division.first_runs[c]; r < division.first_runs[c + 1]; ++r) {
      const Division::Run& run = division.runs[r];
      cost += before.costs[run.chunk] * std::uint64_t{run.end - run.begin} / run.of;
    }
    costs.push_back(static_cast<std::uint32_t>(cost));
  }
  return costs;
}

// Appends pairs and what is kept of them.
void append(const FrontChunk& from, std::size_t begin, std::size_t end, FrontChunk& to) {
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
}

}  // namespace

ChunkSums sums_of(std::span<const FrontChunk> chunks, StopSignal stop) {
  constexpr std::size_t kAtOnce = 64;
  const auto of_piece = [&](std::size_t first, std::size_t end) {
    ChunkSums sums;
    for (const FrontChunk& chunk : chunks.subspan(first, end - first)) {
      sums.pairs += chunk.pairs.size();
      sums.bytes += chunk.memory_bytes();
      sums.too_large |= too_large(chunk);
    }
    return sums;
  };
  const auto join = [](ChunkSums& all, const ChunkSums& piece) {
    all.pairs += piece.pairs;
    all.bytes += piece.bytes;
    all.too_large |= piece.too_large;
  };
  return join_pieces(0, chunks.size(), stop, ChunkSums{}, of_piece, join, kAtOnce);
}

ChunkSums rebalance(FrontSegment& segment, StopSignal stop) {
  constexpr std::size_t kPairs = FrontChunk::kPairs;
  constexpr std::size_t kAtOnce = 8;
  auto& chunks = segment.chunks;
  const ChunkSums sums = sums_of(chunks, stop);
  segment.size = sums.pairs;
  if (chunks.size() < 4 + 4 * (segment.size / kPairs) && !sums.too_large) return sums;
  const Division division(segment);
  std::vector<FrontChunk> balanced(division.first_runs.size() - 1);
  for_pieces(0, balanced.size(), kAtOnce, stop, [&](std::size_t first, std::size_t end) {
    for (std::size_t c = first; c < end; ++c) {
      const std::span runs =
          std::span(division.runs)
              .subspan(division.first_runs[c], division.first_runs[c + 1] - division.first_runs[c]);
      FrontChunk& to = balanced[c];
      const bool moves = !too_large(chunks[runs[0].chunk]);
      if (moves) to = std::move(chunks[runs[0].chunk]);
      for (const Division::Run& run : runs.subspan(moves ? 1 : 0))
        append(chunks[run.chunk], run.begin, run.end, to);
      if (!moves || runs.size() > 1) to.find_nodes();
    }
  });
  segment.costs = costs_after(division, segment);
  chunks = std::move(balanced);
  return sums_of(chunks, stop);
}

}  // namespace warmfront
