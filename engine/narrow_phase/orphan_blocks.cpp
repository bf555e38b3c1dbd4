// SPDX-License-Identifier: Apache-2.0
#include "engine/narrow_phase/orphan_blocks.h"

#include <algorithm>
#include <utility>

#include "engine/narrow_phase/pair_tester.h"

namespace warmfront {

OrphanBlocks::OrphanBlocks(const Scene& scene, const Orphans& orphans, const Orphans& made)
    : scene_(scene),
      orphans_(orphans),
      blocks_((made.vertex_face.size() + made.edge_edge.size() + kOrphans - 1) / kOrphans) {}

MotionState OrphanBlocks::state_of(std::uint32_t orphan, std::span<const MotionState> states) const {
  if (orphan < orphans_.vertex_face.size()) {
    const auto [v, f] = orphans_.vertex_face[orphan];
    const Face& face = scene_.faces()[number_of(f)];
    return states[number_of(v)] | states[face[0]] | states[face[1]] | states[face[2]];
  }
  const EdgeEdgeIds& ids = orphans_.edge_edge[orphan - orphans_.vertex_face.size()];
  const Edge& a = ends_of(scene_, ids.a);
  const Edge& b = ends_of(scene_, ids.b);
  return states[a[0]] | states[a[1]] | states[b[0]] | states[b[1]];
}

void OrphanBlocks::test(std::size_t index, const RangeMotion& motion, std::span<const MotionState> states,
                        bool retest, PairTester& tester) {
  Block& block = blocks_[index];
  const auto run = [&](std::uint32_t orphan) {
    if (orphan < orphans_.vertex_face.size())
      tester.orphan(orphans_.vertex_face[orphan]);
    else
      tester.orphan(orphans_.edge_edge[orphan - orphans_.vertex_face.size()]);
  };
  const auto begin = static_cast<std::uint32_t>(index * kOrphans);
  const auto end = static_cast<std::uint32_t>(
      std::min((index + 1) * kOrphans, orphans_.vertex_face.size() + orphans_.edge_edge.size()));
  const MotionState news = std::exchange(block.tested, true) ? 0 : kChanged;
  if (retest || (motion.all & kMoving) != 0) {
    block.kept.clear();
    for (std::uint32_t orphan = begin; orphan < end; ++orphan) run(orphan);
    return;
  }
  if ((motion.any | news) == 0) {
    for (const Kept& kept : block.kept) tester.keep(kept.contact);
    return;
  }
  std::vector<Kept> kept_now;
  std::vector<Contact> found;
  auto kept = block.kept.cbegin();
  for (std::uint32_t orphan = begin; orphan < end; ++orphan) {
    const MotionState state = state_of(orphan, states) | news;
    if ((state & kMoving) != 0) {
      run(orphan);
    } else if ((state & kChanged) != 0) {
      tester.recording_contacts(found, [&] { run(orphan); });
      for (const Contact& contact : found) kept_now.push_back({orphan, contact});
      found.clear();
    } else {
      while (kept != block.kept.cend() && kept->orphan < orphan) ++kept;
      for (; kept != block.kept.cend() && kept->orphan == orphan; ++kept) {
        tester.keep(kept->contact);
        kept_now.push_back(*kept);
      }
    }
  }
  block.kept = std::move(kept_now);
}

void OrphanBlocks::forget() {
  for (Block& block : blocks_) {
    block.kept.clear();
    block.tested = false;
  }
}

std::size_t OrphanBlocks::memory_bytes() const {
  std::size_t bytes = sizeof(*this) + blocks_.size() * sizeof(Block);
  for (const Block& block : blocks_) bytes += block.kept.capacity() * sizeof(Kept);
  return bytes;
}

}  // namespace warmfront
