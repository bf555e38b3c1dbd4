// SPDX-License-Identifier: Apache-2.0
#include "engine/elementary/narrow_phase.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <tuple>
#include <utility>

#include "engine/bounds/overlap.h"
#include "engine/elementary/pair_tester.h"
#include "engine/scene/adjacency.h"

namespace warmfront {

/// Opens leaf pairs into primitive pairs.
template <class Bounds>
class NarrowPhase<Bounds>::Sink final : public LeafPairSink {
 public:
  void begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input, NarrowPhaseShared& shared,
             std::uint64_t step) {
    if (step_ == step) return;
    step_ = step;
    trees_ = trees;
    scene_ = &input.scene;
    vertex_bounds_ = input.vertex_bounds;
    stop_ = input.stop;
    tester.begin(input, shared);
  }

  LeafGap leaf_pair(const PartPair& parts, const NodePair& leaves) override {
    // One pair of the front may be all the work there is, when what was far apart comes together.
    stop_.check();
    const Bvh<Bounds>& a = trees_[parts.a];
    const Bvh<Bounds>& b = trees_[parts.b];
    const bool same = parts.a == parts.b && leaves.a == leaves.b;
    // Adjacent primitives never come apart and are never tested here.
    constexpr float kFar = std::numeric_limits<float>::max();
    if (a.blocks.empty()) {  // one primitive, whose bounds are the leaf's and were just tested
      if (same) return {kFar, true};
      const Primitive p = a.order[a.shape.begin(leaves.a)];
      const Primitive q = b.order[b.shape.begin(leaves.b)];
      if (adjacent(primitive_vertices(*scene_, p), primitive_vertices(*scene_, q))) return {kFar, true};
      tester.primitive_pair(p, q);
      return {-1, false};
    }
    const std::span<const LeafBlock<Bounds>> blocks_a = a.blocks_of(leaves.a);
    const std::span<const LeafBlock<Bounds>> blocks_b = b.blocks_of(leaves.b);
    const NodeId leaf_a = leaves.a - a.shape.first_leaf();
    const NodeId leaf_b = leaves.b - b.shape.first_leaf();
    const GridPair<Bounds> between = grid_pair(a.grids[leaf_a], b.grids[leaf_b]);
    const OneOfLeaf whole_b = OneOfLeaf::of(b.grids[leaf_b]);
    if (blocks_a.size() == 1 && blocks_b.size() == 1) {
      bring_over(blocks_a[0], between, over_);
      return block_pair(a, blocks_a[0], b, blocks_b[0], between, same ? nullptr : &whole_b);
    }
    const EightBounds<Bounds>& wide_a = a.wide[leaf_a];
    const EightBounds<Bounds>& wide_b = b.wide[leaf_b];
    const EightOverlaps pairs = block_overlaps(wide_a, wide_b, between, whole_b, same, tester.until());
    LeafGap nearest{pairs.gap, false};
    // By blocks of a, so that each is brought over once.
    std::uint32_t brought = EightBounds<Bounds>::kSlots;
    for (std::uint64_t bits = transposed(pairs.to_test); bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      const std::uint32_t i = bit / 8;
      const std::uint32_t j = bit % 8;
      if (std::exchange(brought, i) != i) bring_over(blocks_a[i], between, over_);
      const OneOfLeaf block = OneOfLeaf::of(wide_b, between.begin_at_1_of_b, j);
      const LeafGap gap =
          block_pair(a, blocks_a[i], b, blocks_b[j], between, same && i == j ? nullptr : &block);
      nearest.gap = std::min(nearest.gap, gap.gap);
      nearest.adjacent |= gap.adjacent;
    }
    return nearest;
  }

  LeafGap leaf_pair_at_rest(const PartPair& parts, const NodePair& leaves, std::vector<Contact>& contacts,
                            std::uint32_t& triangle_pairs) override {
    LeafGap gap{};
    const std::uint64_t before = tester.output().counts.triangle_pairs;
    tester.recording(contacts, [&] { gap = leaf_pair(parts, leaves); });
    triangle_pairs = static_cast<std::uint32_t>(tester.output().counts.triangle_pairs - before);
    return gap;
  }

  void keep(std::uint64_t triangle_pairs, std::span<const Contact> contacts) override {
    tester.output().counts.triangle_pairs += triangle_pairs;
    for (const Contact& contact : contacts) tester.keep(contact);
  }

  PairTester tester;

 private:
  // Hands the primitives of two blocks over, of which a was brought over to b; what is learnt, as
  // leaf_pair(). Without `whole_b` they are one block.
  LeafGap block_pair(const Bvh<Bounds>& a, const LeafBlock<Bounds>& block_a, const Bvh<Bounds>& b,
                     const LeafBlock<Bounds>& block_b, const GridPair<Bounds>& between,
                     const OneOfLeaf* whole_b) {
    const bool same = whole_b == nullptr;
    // Two hierarchies have no vertex in common.
    const std::uint64_t shared = &a == &b ? sharing(a, block_a, block_b) : 0;
    const std::uint64_t without = shared | no_pairs(block_a.count, block_b.count, same);
    const EightOverlaps pairs = primitive_overlaps(over_, block_b, between, whole_b, without, tester.until());
    tester.output().counts.primitive_tests +=
        same ? block_a.count * (block_a.count - 1) / 2 : block_a.count * block_b.count;
    for (std::uint64_t bits = pairs.to_test; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      const Primitive p = a.order[block_a.first + bit % 8];
      const Primitive q = b.order[block_b.first + bit / 8];
      // So that which pairs are counted does not depend on the leaves that they are in.
      if ((bits & -bits & pairs.unsure) != 0 && !bounds_overlap(p, q)) continue;
      tester.primitive_pair(p, q);
    }
    return {pairs.gap, shared != 0};
  }

  // The pairs that share a vertex.
  static std::uint64_t sharing(const Bvh<Bounds>& tree, const LeafBlock<Bounds>& a,
                               const LeafBlock<Bounds>& b) {
    const auto at_a = static_cast<std::uint32_t>(&a - tree.blocks.data());
    const auto at_b = static_cast<std::uint32_t>(&b - tree.blocks.data());
    const SharedVertices* shared = tree.shared.get();
    if (shared == nullptr || (shared->crowded(at_a) && shared->crowded(at_b))) return sharing_pairs(a, b);
    return shared->of(at_a, at_b);
  }

  // In float32.
  bool bounds_overlap(Primitive p, Primitive q) const {
    const auto bounds = [this](Primitive primitive) {
      const auto [a, b, c] = primitive_vertices(*scene_, primitive);
      return TriangleBounds{{&vertex_bounds_[a], &vertex_bounds_[b], &vertex_bounds_[c]}};
    };
    return overlap<Bounds>(bounds(p), bounds(q));
  }

  std::span<const Bvh<Bounds>> trees_;
  const Scene* scene_ = nullptr;
  std::span<const PointBounds> vertex_bounds_;
  StopSignal stop_;
  std::uint64_t step_ = 0;
  BroughtOver<Bounds> over_;
};

template <class Bounds>
struct NarrowPhase<Bounds>::Impl {
  tbb::enumerable_thread_specific<Sink> sinks;
  NarrowPhaseShared shared;
  std::span<const Bvh<Bounds>> trees;
  const NarrowPhaseInput* input = nullptr;
  std::uint64_t step = 0;

  Sink& local_sink() {
    Sink& sink = sinks.local();
    sink.begin(trees, *input, shared, step);
    return sink;
  }
};

template <class Bounds>
NarrowPhase<Bounds>::NarrowPhase() : impl_(std::make_unique<Impl>()) {}
template <class Bounds>
NarrowPhase<Bounds>::~NarrowPhase() = default;

template <class Bounds>
void NarrowPhase<Bounds>::begin(std::span<const Bvh<Bounds>> trees, const NarrowPhaseInput& input) {
  impl_->trees = trees;
  impl_->input = &input;
  impl_->shared.earliest.store(2, std::memory_order_relaxed);
  impl_->shared.contacts.store(0, std::memory_order_relaxed);
  ++impl_->step;
  for (Sink& sink : impl_->sinks) sink.begin(trees, input, impl_->shared, impl_->step);
}

template <class Bounds>
LeafPairSink& NarrowPhase<Bounds>::local() {
  return impl_->local_sink();
}

template <class Bounds>
void NarrowPhase<Bounds>::flush() {
  tbb::parallel_for(impl_->sinks.range(1), [](const auto& range) {
    for (Sink& sink : range) sink.tester.flush();
  });
}

template <class Bounds>
double NarrowPhase<Bounds>::elementary_seconds() const {
  double sum = 0;
  for (Sink& sink : impl_->sinks) sum += sink.tester.output().elementary_seconds;
  return sum;
}

template <class Bounds>
void NarrowPhase<Bounds>::test_orphans(std::span<OrphanBlocks* const> parts, bool retest) {
  std::vector<std::size_t> begin{0};  // of each part's blocks
  for (const OrphanBlocks* part : parts) begin.push_back(begin.back() + part->count());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, begin.back(), 2), [&](const auto& range) {
    impl_->input->stop.check();
    PairTester& tester = impl_->local_sink().tester;
    auto part = static_cast<std::size_t>(std::ranges::upper_bound(begin, range.begin()) - begin.begin()) - 1;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      while (i >= begin[part + 1]) ++part;
      parts[part]->test(i - begin[part], *parts[part]->range, impl_->input->states, retest, tester);
    }
  });
  flush();
}

template <class Bounds>
NarrowPhaseOutput NarrowPhase<Bounds>::finish(std::vector<Contact>& contacts) {
  NarrowPhaseOutput sum;
  contacts.clear();
  for (Sink& sink : impl_->sinks) {
    const NarrowPhaseOutput& output = sink.tester.output();
    sum.vf += output.vf;
    sum.ee += output.ee;
    sum.possible += output.possible;
    sum.earliest = std::min(sum.earliest, output.earliest);
    sum.elementary_seconds += output.elementary_seconds;
    sum.over_limit |= output.over_limit;
    add(sum.counts, output.counts);
    contacts.insert(contacts.end(), sink.tester.contacts().begin(), sink.tester.contacts().end());
  }
  if (impl_->input->options.report == Report::kEarliest) {
    std::erase_if(contacts, [&](const Contact& c) { return c.toi > sum.earliest; });
    sum.vf =
        static_cast<std::uint64_t>(std::ranges::count(contacts, ContactKind::kVertexFace, &Contact::kind));
    sum.ee = contacts.size() - sum.vf;
    sum.over_limit = contacts.size() > impl_->input->options.max_contacts;
    sum.possible = static_cast<std::uint64_t>(std::ranges::count_if(contacts, [](const Contact& c) {
      return c.status == ContactStatus::kPossible || c.status == ContactStatus::kBudget;
    }));
  }
  tbb::parallel_sort(contacts.begin(), contacts.end(), [](const Contact& x, const Contact& y) {
    return std::tie(x.kind, x.a, x.b) < std::tie(y.kind, y.a, y.b);
  });
  return sum;
}

template <class Bounds>
std::size_t NarrowPhase<Bounds>::memory_bytes() const {
  std::size_t bytes = 0;
  for (const Sink& sink : impl_->sinks) bytes += sink.tester.memory_bytes();
  return bytes;
}

template class NarrowPhase<Aabb>;
template class NarrowPhase<KDop18>;

}  // namespace warmfront
