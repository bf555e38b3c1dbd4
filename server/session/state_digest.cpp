// SPDX-License-Identifier: Apache-2.0
// A hash for comparing, not against forgers: who steps a session may as well say what it is. Four lanes of 64
// bits, whose steps are independent, keep a core's multiplier busy; each step is a bijection of its lane and
// of its word, so that two inputs that differ in one word never meet in their lane, and the rotation carries
// what a multiplication leaves in the high bits, such as a sign, to the low ones. Thread safety as stated in
// the header.
#include "server/session/state_digest.h"

#include <array>
#include <bit>
#include <cstring>

namespace warmfront::server {
namespace {

// Odd, their bits in no pattern.
constexpr std::uint64_t kSpread = 0xd6e8a3b5719c4f2d;
constexpr std::uint64_t kMix = 0xa24b1c9f3e7d5863;

constexpr std::size_t kLanes = 4;
constexpr std::size_t kBlock = kLanes * sizeof(std::uint64_t);

std::uint64_t step(std::uint64_t lane, std::uint64_t word) {
  return std::rotl(lane ^ (word * kSpread), 29) * kMix;
}

/// Every bit of the value in every bit of the result; a bijection.
std::uint64_t scatter(std::uint64_t value) {
  value = (value ^ (value >> 32)) * kSpread;
  value = (value ^ (value >> 29)) * kMix;
  return value ^ (value >> 32);
}

std::uint64_t word_at(const char* bytes) {
  std::uint64_t word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

}  // namespace

void StateDigest::add(std::uint64_t number) {
  value_ = scatter(step(value_, number));
}

void StateDigest::add(std::string_view bytes) {
  std::array<std::uint64_t, kLanes> lanes;
  for (std::size_t lane = 0; lane < kLanes; ++lane) lanes[lane] = scatter(value_ + (lane + 1) * kMix);
  const char* at = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= kBlock; at += kBlock, left -= kBlock) {
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      lanes[lane] = step(lanes[lane], word_at(at + lane * sizeof(std::uint64_t)));
  }
  if (left > 0) {
    // Zeros fill the last block: the number of bytes, below, tells them from zeros that were there.
    std::array<char, kBlock> last{};
    std::memcpy(last.data(), at, left);
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      lanes[lane] = step(lanes[lane], word_at(last.data() + lane * sizeof(std::uint64_t)));
  }
  add(std::uint64_t{bytes.size()});
  for (const std::uint64_t lane : lanes) add(lane);
}

}  // namespace warmfront::server
