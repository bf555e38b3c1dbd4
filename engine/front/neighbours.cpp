// SPDX-License-Identifier: Apache-2.0
#include "engine/front/neighbours.h"

#include <algorithm>
#include <utility>

#include "engine/parallel/stoppable_loops.h"
#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

// Rows of four as columns.
template <class Vector>
struct Columns {
  Vector of[4];

  WARMFRONT_INLINE Columns(Vector a, Vector b, Vector c, Vector d) {
    const Vector ab_low = shuffle<0, 4, 1, 5>(a, b);
    const Vector cd_low = shuffle<0, 4, 1, 5>(c, d);
    const Vector ab_high = shuffle<2, 6, 3, 7>(a, b);
    const Vector cd_high = shuffle<2, 6, 3, 7>(c, d);
    of[0] = shuffle<0, 1, 4, 5>(ab_low, cd_low);
    of[1] = shuffle<2, 3, 6, 7>(ab_low, cd_low);
    of[2] = shuffle<0, 1, 4, 5>(ab_high, cd_high);
    of[3] = shuffle<2, 3, 6, 7>(ab_high, cd_high);
  }
};

// TravelBudget::exhausted() of four pairs, a bit each: the same operations on the same numbers.
WARMFRONT_INLINE std::uint32_t exhausted_of_four(const NeighbourPair* pairs, const NodeTravel* travel,
                                                 std::uint32_t reserve) {
  static_assert(sizeof(TravelBudget) == sizeof(Float4) && sizeof(NodeTravel) == sizeof(Float4));
  Float4 offset[4];  // the fourth lane is none
  UInt4 left[4];     // the fourth lane is what is left of the gap, the others are nothing
  for (int i = 0; i < 4; ++i) {
    const auto a = load<Float4>(&travel[number_of(pairs[i].a)]);
    const auto b = load<Float4>(&travel[number_of(pairs[i].b)]);
    const auto budget = load<Float4>(&pairs[i].budget);
    offset[i] = (a - b) - budget;
    left[i] = (UInt4)budget - (UInt4)a - (UInt4)b;
  }
  const Columns offsets(offset[0], offset[1], offset[2], offset[3]);
  const Columns lefts(left[0], left[1], left[2], left[3]);
  const Float4 usable = __builtin_convertvector((Int4)(lefts.of[3] - reserve), Float4);
  Int4 lasts = Int4{} - 1;
  for (int k = 0; k < 3; ++k) lasts &= (Int4)(magnitude(offsets.of[k]) * travel::kUnits < usable);
  const Int4 bits = ~lasts & Int4{1, 2, 4, 8};
  return static_cast<std::uint32_t>(bits[0] | bits[1] | bits[2] | bits[3]);
}

std::size_t bytes_of(std::span<const NeighbourChunk> chunks) {
  std::size_t bytes = 0;
  for (const NeighbourChunk& chunk : chunks) bytes += chunk.list_bytes();
  return bytes;
}

}  // namespace

WARMFRONT_TARGET_CLONES
std::size_t due_neighbours(std::span<const NeighbourPair> pairs, std::span<const NodeTravel> travel,
                           std::uint32_t reserve, std::uint32_t* due) {
  std::size_t count = 0;
  std::uint32_t n = 0;
  for (; n + 4 <= pairs.size(); n += 4) {
    const std::uint32_t exhausted = exhausted_of_four(&pairs[n], travel.data(), reserve);
    for (std::uint32_t i = 0; i < 4; ++i) {
      due[count] = n + i;
      count += (exhausted >> i) & 1;
    }
  }
  for (; n < pairs.size(); ++n) {
    due[count] = n;
    count += pairs[n].budget.exhausted(travel[number_of(pairs[n].a)], travel[number_of(pairs[n].b)], reserve)
                 ? 1
                 : 0;
  }
  return count;
}

template <class Bounds>
bool Neighbours::list(PartId part, const Bvh<Bounds>& tree, std::size_t max_bytes, StopSignal stop) {
  if (number_of(part) >= of_part_.size()) of_part_.resize(number_of(part) + 1);
  OfPart& of = of_part_[number_of(part)];
  if (std::exchange(of.tried, true)) return false;
  std::vector<NeighbourChunk> listed = list_neighbours(tree, stop);
  const std::size_t bytes = list_bytes_ + bytes_of(listed);
  if (bytes > max_bytes) return false;
  list_bytes_ = bytes;
  of.chunks = std::move(listed);
  of.subtrees = tree.shape.subtree_count();
  return !of.chunks.empty();
}

template <class Bounds>
bool Neighbours::follow(PartId part, const Bvh<Bounds>& tree, std::span<const std::uint8_t> changed_blocks,
                        std::size_t max_bytes, StopSignal stop) {
  OfPart& of = of_part_[number_of(part)];
  if (of.subtrees != tree.shape.subtree_count() || tree.leaves.shared == nullptr) return false;
  const std::size_t others = list_bytes_ - bytes_of(of.chunks);
  std::vector<NeighbourChunk> listed =
      follow_neighbours<Bounds>(tree, std::exchange(of.chunks, {}), changed_blocks, stop);
  const std::size_t bytes = others + bytes_of(listed);
  list_bytes_ = bytes;
  of.chunks = std::move(listed);
  return bytes <= max_bytes;
}

void Neighbours::forget(PartId part) {
  if (number_of(part) >= of_part_.size()) return;
  list_bytes_ -= bytes_of(of_part_[number_of(part)].chunks);
  of_part_[number_of(part)] = {};
}

void Neighbours::clear() {
  std::vector<OfPart>().swap(of_part_);
  list_bytes_ = 0;
}

void Neighbours::forget_answers() {
  for (OfPart& part : of_part_) {
    for (NeighbourChunk& chunk : part.chunks) chunk.at_rest = {};
  }
}

void Neighbours::settle(PartId part, std::span<const NodeTravel> block_travel,
                        std::uint32_t reserve) noexcept {
  for (NeighbourChunk& chunk : of(part)) {
    for (NeighbourPair& pair : chunk.pairs) {
      const NodeTravel& at_a = block_travel[number_of(pair.a)];
      const NodeTravel& at_b = block_travel[number_of(pair.b)];
      if (!pair.budget.exhausted(at_a, at_b, reserve)) continue;
      pair.budget.spend(at_a, at_b);
      chunk.may_have_contacts = true;
      chunk.at_rest.known = false;
    }
  }
}

void Neighbours::leave_trial(PartId part, const TrialTravel& blocks, TrialLeft left,
                             std::uint32_t reserve) noexcept {
  for (NeighbourChunk& chunk : of(part)) {
    for (NeighbourPair& pair : chunk.pairs) {
      if (warmfront::leave_trial(pair.budget, blocks, number_of(pair.a), blocks, number_of(pair.b), left,
                                 reserve))
        continue;
      chunk.may_have_contacts = true;
      chunk.at_rest.known = false;
    }
  }
}

std::size_t Neighbours::pair_bytes() const {
  std::size_t bytes = 0;
  for (const OfPart& part : of_part_) {
    for (const NeighbourChunk& chunk : part.chunks) bytes += chunk.memory_bytes();
  }
  return bytes;
}

std::size_t Neighbours::memory_bytes() const {
  constexpr std::size_t kOfChunk = 32;  // the allocator rounds up, by up to 15 bytes each of two lists
  std::size_t bytes = pair_bytes() + of_part_.capacity() * sizeof(OfPart);
  for (const OfPart& part : of_part_)
    bytes += part.chunks.size() * kOfChunk +
             (part.chunks.capacity() - part.chunks.size()) * sizeof(NeighbourChunk);
  return bytes;
}

template bool Neighbours::follow(PartId, const Bvh<Aabb>&, std::span<const std::uint8_t>, std::size_t,
                                 StopSignal);
template bool Neighbours::follow(PartId, const Bvh<KDop18>&, std::span<const std::uint8_t>, std::size_t,
                                 StopSignal);
template bool Neighbours::list(PartId, const Bvh<Aabb>&, std::size_t, StopSignal);
template bool Neighbours::list(PartId, const Bvh<KDop18>&, std::size_t, StopSignal);

}  // namespace warmfront
