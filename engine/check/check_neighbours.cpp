// SPDX-License-Identifier: Apache-2.0
#include "engine/check/check_neighbours.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>

#include "engine/bounds/moving.h"
#include "engine/bounds/overlap.h"

namespace warmfront {
namespace {

bool same_lists(const NeighbourChunk& x, const NeighbourChunk& y) {
  return std::ranges::equal(x.leaves, y.leaves) &&
         std::ranges::equal(x.pairs, y.pairs, [](const NeighbourPair& p, const NeighbourPair& q) {
           return p.a == q.a && p.b == q.b && p.excluded == q.excluded;
         });
}

template <class Bounds>
class Ends {
 public:
  Ends(const Bvh<Bounds>& tree, const Scene& scene, std::span<const PointBounds> vertex_bounds,
       const Width& width)
      : tree_(tree), scene_(scene), vertex_bounds_(vertex_bounds), width_(width) {}

  bool apart(const NeighbourPair& pair) const {
    const std::uint64_t excluded =
        sharing_pairs(tree_.leaves.corners[number_of(pair.a)], tree_.leaves.corners[number_of(pair.b)]) |
        tree_.no_pairs(pair.a, pair.b);
    for (std::uint64_t bits = ~excluded; bits != 0; bits &= bits - 1) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(bits));
      if (overlap(bounds(pair.a, bit / 8), bounds(pair.b, bit % 8), width_)) return false;
    }
    return true;
  }

 private:
  // The bounds of a primitive that is stationary at the end of the step.
  Bounds bounds(BlockId block, std::uint32_t i) const {
    Bounds bounds = Bounds::empty();
    for (const std::uint32_t v :
         primitive_vertices(scene_, tree_.order[tree_.shape.begin_of_block(block) + i]))
      bounds.merge(narrow<Bounds>(bounds_of(vertex_bounds_[v])));
    bounds.shift();
    return bounds;
  }

  const Bvh<Bounds>& tree_;
  const Scene& scene_;
  std::span<const PointBounds> vertex_bounds_;
  const Width width_;
};

}  // namespace

template <class Bounds>
std::string broken_neighbours(std::span<const NeighbourChunk> kept, const Bvh<Bounds>& tree,
                              const Scene& scene, std::span<const PointBounds> vertex_bounds,
                              const Width& width, std::uint64_t turn, StopSignal stop) {
  if (!std::ranges::equal(kept, list_neighbours(tree, stop), same_lists))
    return "does not list the neighbouring blocks";
  const Ends<Bounds> ends(tree, scene, vertex_bounds, width);
  const std::uint32_t reserve = travel::reserve(2 * tree.travel.slack, width);
  std::atomic<std::uint64_t> wrong{0};  // one more than the last wrong block found; 0: none
  const auto check = [&](std::size_t turns) {
    const std::size_t c = turns * kBudgetTurns + turn % kBudgetTurns;
    if (c >= kept.size()) return;
    PacedStop paced(stop, 64);
    stop.check();
    for (const NeighbourPair& pair : kept[c].pairs) {
      paced.check();
      const bool lasts = !pair.budget.exhausted(tree.travel.blocks[number_of(pair.a)],
                                                tree.travel.blocks[number_of(pair.b)], reserve);
      if (lasts && !ends.apart(pair)) wrong = std::uint64_t{number_of(pair.a)} + 1;
    }
  };
  tbb::parallel_for(std::size_t{0}, kept.size() / kBudgetTurns + 1, check);
  if (wrong == 0) return "";
  return "marks block " + std::to_string(wrong - 1) + " and a neighbour as apart";
}

template std::string broken_neighbours(std::span<const NeighbourChunk>, const Bvh<Aabb>&, const Scene&,
                                       std::span<const PointBounds>, const Width&, std::uint64_t,
                                       StopSignal);
template std::string broken_neighbours(std::span<const NeighbourChunk>, const Bvh<KDop18>&, const Scene&,
                                       std::span<const PointBounds>, const Width&, std::uint64_t,
                                       StopSignal);

}  // namespace warmfront
