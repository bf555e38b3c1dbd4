// SPDX-License-Identifier: Apache-2.0
// A hash for comparing, not against forgers: who steps a session may as well say what it is. Eight lanes of
// 64 bits, whose steps are independent, keep a core's multiplier busy; each step is a bijection of its lane
// and of its word, so that two inputs that differ in one word never meet in their lane, and the rotation
// carries what a multiplication leaves in the high bits, such as a sign, to the low ones. Thread safety as
// stated in the header.
#include "server/session/state_digest.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstring>

#include "engine/simd/target_clones.h"

namespace warmfront::server {
namespace {

// Odd, their bits in no pattern.
constexpr std::uint64_t kSpread = 0xd6e8a3b5719c4f2d;
constexpr std::uint64_t kMix = 0xa24b1c9f3e7d5863;

WARMFRONT_INLINE std::uint64_t step(std::uint64_t lane, std::uint64_t word) {
  return std::rotl(lane ^ (word * kSpread), 29) * kMix;
}

/// Every bit of the value in every bit of the result; a bijection.
std::uint64_t scatter(std::uint64_t value) {
  value = (value ^ (value >> 32)) * kSpread;
  value = (value ^ (value >> 29)) * kMix;
  return value ^ (value >> 32);
}

WARMFRONT_INLINE std::uint64_t word_at(const char* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

constexpr std::size_t kLanes = 8;
constexpr std::size_t kBlock = kLanes * sizeof(std::uint64_t);
using Lanes = std::array<std::uint64_t, kLanes>;

WARMFRONT_INLINE void add_block(Lanes& lanes, const char* block) {
  for (std::size_t lane = 0; lane < kLanes; ++lane)
    lanes[lane] = step(lanes[lane], word_at(block + lane * sizeof(std::uint64_t)));
}

WARMFRONT_LONG_PRODUCT_CLONES
void add_blocks(Lanes& lanes, const char* at, std::size_t count) {
  Lanes local = lanes;  // in registers
  for (; count > 0; --count, at += kBlock) add_block(local, at);
  lanes = local;
}

// Block by block, so that the processor hashes some while it waits for the next: a client's last writes are
// in another core's cache. The fence keeps the compiler from hashing what it would read from there a second
// time.
WARMFRONT_LONG_PRODUCT_CLONES
void copy_blocks(Lanes& lanes, const char* from, char* to, std::size_t count) {
  Lanes local = lanes;
  for (; count > 0; --count, from += kBlock, to += kBlock) {
    std::memcpy(to, from, kBlock);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    add_block(local, to);
  }
  lanes = local;
}

}  // namespace

void StateDigest::add(std::uint64_t number) {
  value_ = scatter(step(value_, number));
}

void StateDigest::add(const ContentHash& content) {
  add(content.bytes_);
  for (const std::uint64_t lane : content.ended()) add(lane);
}

ContentHash::ContentHash() {
  for (std::size_t lane = 0; lane < kLanes; ++lane) lanes_[lane] = scatter((lane + 1) * kMix);
}

void ContentHash::add(std::string_view piece) {
  const std::size_t begun = bytes_ % kBlock;
  bytes_ += piece.size();
  if (begun > 0) {
    const std::string_view rest = piece.substr(0, kBlock - begun);
    std::ranges::copy(rest, begun_.begin() + begun);
    if (begun + rest.size() < kBlock) return;
    add_blocks(lanes_, begun_.data(), 1);
    piece.remove_prefix(rest.size());
  }
  add_blocks(lanes_, piece.data(), piece.size() / kBlock);
  std::ranges::copy(piece.substr(piece.size() - piece.size() % kBlock), begun_.begin());
}

void ContentHash::copy(std::string_view piece, char* to) {
  const auto copy_some = [&](std::size_t count) {
    std::memcpy(to, piece.data(), count);
    std::atomic_signal_fence(std::memory_order_seq_cst);
    add({to, count});
    to += count;
    piece.remove_prefix(count);
  };
  // The rest of a block that has begun, whole blocks, and the beginning of the next.
  if (const std::size_t begun = bytes_ % kBlock; begun > 0) copy_some(std::min(kBlock - begun, piece.size()));
  if (piece.empty()) return;
  const std::size_t blocks = piece.size() / kBlock;
  copy_blocks(lanes_, piece.data(), to, blocks);
  bytes_ += blocks * kBlock;
  to += blocks * kBlock;
  piece.remove_prefix(blocks * kBlock);
  copy_some(piece.size());
}

ContentHash::Lanes ContentHash::ended() const {
  Lanes lanes = lanes_;
  if (const std::size_t begun = bytes_ % kBlock; begun > 0) {
    // Zeros fill the last block: the number of bytes tells them from zeros that were there.
    std::array<char, kBlock> last{};
    std::copy_n(begun_.begin(), begun, last.begin());
    add_blocks(lanes, last.data(), 1);
  }
  return lanes;
}

}  // namespace warmfront::server
