// SPDX-License-Identifier: Apache-2.0
#include "engine/motion/trial_way.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/motion/range_grains.h"
#include "engine/parallel/stoppable_loops.h"
#include "engine/simd/lanes.h"

namespace warmfront {
namespace {

/// The farthest vertex is looked for in a block of so many.
constexpr std::size_t kBlock = 256;
constexpr std::uint64_t kNoBlock = 0xffffffff;

WARMFRONT_INLINE Double4 displacement(const VertexMotion& vertex, const LocalTransform& frame) {
  return (load<Double4>(vertex.t1.data()) - load<Double4>(vertex.t0.data())) * frame.scale_a * frame.scale_b;
}

// Returns the bits of the largest magnitude; those of what is not finite are larger than all others.
WARMFRONT_TARGET_CLONES
std::uint32_t take_range(std::span<const VertexMotion> vertices, const LocalTransform& frame,
                         std::array<float, 4>* displacements) {
  Int4 most{};
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Float4 local = to_floats(displacement(vertices[v], frame));
    std::memcpy(&displacements[v], &local, sizeof local);
    most = greater((Int4)local & std::numeric_limits<std::int32_t>::max(), most);
  }
  return static_cast<std::uint32_t>(std::max(std::max(most[0], most[1]), most[2]));
}

// Are all within `room` of the fraction of their displacements? A displacement in float32 is off by 2^-24 of
// itself; false for what is not a number.
WARMFRONT_TARGET_CLONES
bool within(std::span<const VertexMotion> vertices, const LocalTransform& frame,
            const std::array<float, 4>* displacements, double fraction, double room) {
  Long4 all = Long4{} - 1;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Double4 whole = to_doubles(load<Float4>(displacements[v].data()));
    const Double4 here = displacement(vertices[v], frame);
    const Double4 off = magnitude(here - fraction * whole) + 0x1p-23 * magnitude(whole);
    all &= (Long4)(off <= room);
    // What rested rests.
    const Long4 rested = (Long4)(whole == 0.0);
    const bool all_rested = (rested[0] & rested[1] & rested[2]) != 0;
    const Long4 rests = (Long4)(here == 0.0);
    if (all_rested && (rests[0] & rests[1] & rests[2]) == 0) return false;
  }
  return (all[0] & all[1] & all[2]) != 0;
}

}  // namespace

void TrialWay::take(const Motion& motion, StopSignal stop) {
  known_ = false;
  const std::span<const VertexMotion> vertices = motion.vertices();
  displacement_.resize(vertices.size());
  // The largest magnitude's bits, and which block it is in: the first of several, so that no number of
  // threads makes a difference.
  std::atomic<std::uint64_t> most{0};
  for_pieces(0, vertices.size(), kGrain, stop, [&](std::size_t begin, std::size_t end) {
    std::uint64_t here = 0;
    for (std::size_t first = begin; first < end;) {
      const std::size_t block = first / kBlock;
      const std::size_t next = std::min((block + 1) * kBlock, end);
      const std::uint64_t bits =
          take_range(vertices.subspan(first, next - first), motion.frame(), displacement_.data() + first);
      here = std::max(here, (bits << 32) | (kNoBlock - block));
      first = next;
    }
    std::uint64_t before = most.load(std::memory_order_relaxed);
    while (here > before && !most.compare_exchange_weak(before, here, std::memory_order_relaxed)) {
    }
  });
  const auto farthest = std::bit_cast<float>(static_cast<std::uint32_t>(most.load() >> 32));
  if (!std::isfinite(farthest) || !(farthest > std::numeric_limits<float>::min())) return;
  const std::size_t first = (kNoBlock - (most.load() & kNoBlock)) * kBlock;
  for (std::size_t v = first; v < std::min(first + kBlock, displacement_.size()); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      if (std::fabs(displacement_[v][axis]) != farthest) continue;
      farthest_ = v;
      axis_ = axis;
      known_ = true;
      return;
    }
  }
}

std::optional<double> TrialWay::fraction_of(const Motion& motion, double magnitude, StopSignal stop) const {
  const std::span<const VertexMotion> vertices = motion.vertices();
  if (!known_ || vertices.size() != displacement_.size()) return std::nullopt;
  const auto axis = static_cast<std::size_t>(axis_);
  const VertexMotion& farthest = vertices[farthest_];
  const double here = motion.frame().to_local(farthest.t1[axis] - farthest.t0[axis]);
  double fraction = here / static_cast<double>(displacement_[farthest_][axis]);
  if (!(fraction >= 0 && fraction <= 1 + 0x1p-23)) return std::nullopt;
  fraction = std::min(fraction, 1.0);
  const double room = kBesideTheWay * magnitude;
  std::atomic<bool> all{true};
  for_pieces(0, vertices.size(), kGrain, stop, [&](std::size_t begin, std::size_t end) {
    if (!all.load(std::memory_order_relaxed)) return;
    if (!within(vertices.subspan(begin, end - begin), motion.frame(), displacement_.data() + begin, fraction,
                room))
      all.store(false, std::memory_order_relaxed);
  });
  return all.load() ? std::optional(fraction) : std::nullopt;
}

}  // namespace warmfront
