// SPDX-License-Identifier: Apache-2.0
#include "engine/front/chunks.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace warmfront {

void ChunkOutputs::reset(std::size_t chunks, std::size_t max_pairs) {
  for (ThreadOutput& thread : threads_) {
    thread.pairs.clear();
    thread.bv_tests = thread.sprouted = thread.pruned = 0;
  }
  pieces_.assign(chunks, {});
  max_pairs_ = max_pairs;
  total_.store(0, std::memory_order_relaxed);
}

ChunkOutputs::Chunk::Chunk(ChunkOutputs& outputs, std::size_t index)
    : outputs_(outputs),
      thread_(outputs.threads_.local()),
      index_(index),
      begin_(thread_.pairs.size()),
      recording_(!outputs.overflowed()) {}

ChunkOutputs::Chunk::~Chunk() {
  const std::size_t end = thread_.pairs.size();
  outputs_.pieces_[index_] = {&thread_, begin_, end};
  // A chunk that stopped recording marks the whole as overflowed already.
  outputs_.total_.fetch_add(end - begin_, std::memory_order_relaxed);
}

void ChunkOutputs::concatenate(std::vector<NodePair>& into) const {
  std::vector<std::size_t> offsets(pieces_.size() + 1, 0);
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    offsets[i + 1] = offsets[i] + (pieces_[i].end - pieces_[i].begin);
  }
  into.resize(offsets.back());
  tbb::parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t i) {
    const Piece& piece = pieces_[i];
    if (piece.begin == piece.end) return;
    std::copy(piece.thread->pairs.begin() + static_cast<std::ptrdiff_t>(piece.begin),
              piece.thread->pairs.begin() + static_cast<std::ptrdiff_t>(piece.end),
              into.begin() + static_cast<std::ptrdiff_t>(offsets[i]));
  });
}

ThreadOutput ChunkOutputs::totals() {
  ThreadOutput sum;
  for (const ThreadOutput& thread : threads_) {
    sum.bv_tests += thread.bv_tests;
    sum.sprouted += thread.sprouted;
    sum.pruned += thread.pruned;
  }
  return sum;
}

void ChunkOutputs::release() {
  threads_.clear();
  pieces_ = {};
}

std::size_t ChunkOutputs::memory_bytes() const {
  std::size_t bytes = pieces_.capacity() * sizeof(Piece);
  for (const ThreadOutput& thread : threads_) bytes += thread.pairs.capacity() * sizeof(NodePair);
  return bytes;
}

}  // namespace warmfront
