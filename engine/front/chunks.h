// SPDX-License-Identifier: Apache-2.0
// Private output of parallel chunks, put together in chunk order: the result depends on the data, not on the
// threads.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/front/node_pair.h"

namespace warmfront {

/// What one thread has written, chunk after chunk.
struct ThreadOutput {
  std::vector<NodePair> pairs;
  std::uint64_t bv_tests = 0;
  std::uint64_t sprouted = 0;
  std::uint64_t pruned = 0;
};

/// Buffers are kept from step to step, so that a warm step allocates nothing.
class ChunkOutputs {
 public:
  /// Forgets all output and makes room for `chunks` chunks, of which at most `max_pairs` pairs in all are
  /// kept.
  void reset(std::size_t chunks, std::size_t max_pairs);

  /// The output of one chunk; a thread works on one chunk at a time. Thread-safe for different chunks.
  class Chunk {
   public:
    Chunk(ChunkOutputs& outputs, std::size_t index);
    ~Chunk();
    Chunk(const Chunk&) = delete;
    Chunk& operator=(const Chunk&) = delete;
    void push(const NodePair& pair) {
      // A chunk that alone exceeds the limit stops there: what it has marks the whole as overflowed.
      if (recording_ && thread_.pairs.size() - begin_ <= outputs_.max_pairs_) thread_.pairs.push_back(pair);
    }
    std::uint64_t& bv_tests() { return thread_.bv_tests; }
    std::uint64_t& sprouted() { return thread_.sprouted; }
    std::uint64_t& pruned() { return thread_.pruned; }

   private:
    ChunkOutputs& outputs_;
    ThreadOutput& thread_;
    std::size_t index_;
    std::size_t begin_;
    bool recording_;
  };

  /// True when more than max_pairs were pushed; the output is then incomplete.
  bool overflowed() const { return total_.load(std::memory_order_relaxed) > max_pairs_; }
  /// All pairs in chunk order. Parallel. Requires !overflowed().
  void concatenate(std::vector<NodePair>& into) const;
  /// Sums of the threads' counters.
  ThreadOutput totals();
  /// Frees the buffers.
  void release();
  std::size_t memory_bytes() const;

 private:
  struct Piece {
    const ThreadOutput* thread = nullptr;
    std::size_t begin = 0;
    std::size_t end = 0;
  };

  tbb::enumerable_thread_specific<ThreadOutput> threads_;
  std::vector<Piece> pieces_;
  std::size_t max_pairs_ = 0;
  std::atomic<std::size_t> total_{0};
};

}  // namespace warmfront
