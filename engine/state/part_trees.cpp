// SPDX-License-Identifier: Apache-2.0
#include "engine/state/part_trees.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "engine/bounds/moving.h"
#include "engine/bvh/build.h"
#include "engine/bvh/node_patches.h"
#include "engine/motion/range_grains.h"
#include "engine/parallel/stoppable_loops.h"

namespace warmfront {
namespace {

/// A hierarchy is rebuilt when its looseness has grown this much since its build; looked at every few steps.
constexpr double kLoosenessLimit = 2.0;
constexpr std::int64_t kLoosenessSteps = 4;

template <class Bounds>
std::vector<std::uint32_t> patches_of(const Core& core, const Bvh<Bounds>& tree, StopSignal stop) {
  return node_patches(core.topology->scene, tree.shape, tree.order, core.filter.patches(), stop);
}

}  // namespace

template <class Bounds>
std::size_t PartTrees<Bounds>::arrange_new(const Core& core, bool rebuild, StopSignal stop) {
  const auto& parts = core.topology->parts;
  const Scene& scene = core.topology->scene;
  refit_in_.resize(parts.size(), kNever);
  states_.resize(parts.size());
  off_base_.resize(parts.size());
  bases_.resize(parts.size());
  roots_.resize(parts.size());
  changed_.resize(parts.size());
  const auto change_tree = [&](std::size_t p) {
    if (changed_[p].empty()) return;
    if (core.model.is_removed(PartId{static_cast<std::uint32_t>(p)})) return changed_[p].clear();
    const SharedVertices* const before = trees_[p].leaves.shared.get();
    if (before != nullptr && parts[p].shared != nullptr)
      list_changed_rows(*before, *parts[p].shared, changed_[p]);
    else if (before != parts[p].shared.get())
      std::ranges::fill(changed_[p], std::uint8_t{1});
    trees_[p].change(scene, parts[p].shape, parts[p].order, parts[p].shared, changed_[p], stop);
    trees_[p].patches = patches_of(core, trees_[p], stop);
  };
  if (some_changed_) fork_each(std::size_t{0}, trees_.size(), change_tree);
  if (rebuild) {
    for (std::size_t p = 0; p < trees_.size(); ++p) {
      if (trees_[p].leaves.shared == nullptr && parts[p].shared != nullptr)
        trees_[p].leaves.shared = shared_vertices(scene, trees_[p].shape, trees_[p].order, stop);
    }
  }
  const std::size_t first = trees_.size();
  trees_.resize(parts.size());
  const auto arrange = [&](std::size_t p) {
    const double built_looseness = trees_[p].built_looseness;
    trees_[p].arrange(scene, parts[p].shape, parts[p].order, parts[p].shared, is_lazy(core.options), stop);
    trees_[p].built_looseness = built_looseness;
    trees_[p].patches = patches_of(core, trees_[p], stop);
  };
  std::vector<std::uint32_t> forgotten;
  for (std::uint32_t p = 0; some_forgotten_ && p < first; ++p) {
    if (trees_[p].order.empty() && !parts[p].order.empty() && !core.model.is_removed(PartId{p}))
      forgotten.push_back(p);
  }
  fork_each(std::size_t{0}, forgotten.size(), [&](std::size_t i) { arrange(forgotten[i]); });
  some_forgotten_ = false;
  fork_each(first, parts.size(), arrange);
  std::fill(refit_in_.begin() + static_cast<std::ptrdiff_t>(first), refit_in_.end(), kNever);
  std::fill(bases_.begin() + static_cast<std::ptrdiff_t>(first), bases_.end(), Base{});
  return forgotten.size() + parts.size() - first;
}

template <class Bounds>
HeldOrder PartTrees<Bounds>::hierarchy_of(const Core& core, PartId part) const {
  if (number_of(part) >= trees_.size() || trees_[number_of(part)].order.empty() ||
      !changed_[number_of(part)].empty()) {
    const PartTopology& topology = core.topology->parts[number_of(part)];
    return {topology.shape, topology.order, topology.shared};
  }
  const Bvh<Bounds>& tree = trees_[number_of(part)];
  const bool known = refit_in_[number_of(part)] != kNever && tree.built_looseness > 0;
  if (known && looseness(tree, true) > kLoosenessLimit * tree.built_looseness) return {};
  return {tree.shape, tree.order, tree.leaves.shared};
}

template <class Bounds>
void PartTrees<Bounds>::forget(PartId part, bool keeps_hierarchy) noexcept {
  if (number_of(part) >= trees_.size()) return;
  const double built_looseness = keeps_hierarchy ? trees_[number_of(part)].built_looseness : 0;
  trees_[number_of(part)] = {};
  trees_[number_of(part)].built_looseness = built_looseness;
  changed_[number_of(part)].clear();
  refit_in_[number_of(part)] = kNever;
  bases_[number_of(part)] = {};
  states_[number_of(part)] = 0;
  some_forgotten_ = true;
}

template <class Bounds>
bool PartTrees<Bounds>::change(PartId part, std::vector<std::uint8_t>&& blocks) noexcept {
  constexpr std::ptrdiff_t kMost = 16;  // one of so many: of more, looking again costs what is saved
  if (number_of(part) >= trees_.size() || trees_[number_of(part)].order.empty()) return false;
  std::vector<std::uint8_t>& changed = changed_[number_of(part)];
  if (!changed.empty()) std::ranges::transform(changed, blocks, blocks.begin(), std::bit_or<>());
  const auto size = static_cast<std::ptrdiff_t>(blocks.size());
  if (std::ranges::count(blocks, 1) * kMost > size) return false;
  changed = std::move(blocks);
  some_changed_ = true;
  return true;
}

template <class Bounds>
std::span<const PartId> PartTrees<Bounds>::rearrange_loose(const Core& core, StopSignal stop) {
  rearranged_.clear();
  if (step_ % kLoosenessSteps != 0) return {};
  for (std::uint32_t p = 0; p < trees_.size(); ++p) {
    Bvh<Bounds>& tree = trees_[p];
    const bool known = refit_in_[p] == step_ - 1 && tree.built_looseness > 0;
    if (!known || core.model.is_removed(PartId{p}) || (core.motion.state(PartId{p}) & kMoving) == 0) continue;
    if (!(looseness(tree) > kLoosenessLimit * tree.built_looseness)) continue;  // or is not a number
    const Scene& scene = core.topology->scene;
    const std::vector<Primitive> order =
        build_order(scene, core.motion.vertices(), tree.shape, tree.order, stop);
    auto shared = tree.leaves.shared == nullptr ? nullptr : shared_vertices(scene, tree.shape, order, stop);
    tree.arrange(scene, tree.shape, order, std::move(shared), is_lazy(core.options), stop);
    tree.patches = patches_of(core, tree, stop);
    refit_in_[p] = kNever;
    bases_[p] = {};
    rearranged_.push_back(PartId{p});
  }
  return rearranged_;
}

template <class Bounds>
bool PartTrees<Bounds>::take_magnitude(double magnitude) {
  if (std::exchange(magnitude_, magnitude) == magnitude) return false;
  forget_bounds();  // which have the smaller margin
  return true;
}

// Bounds of a part's vertices: of all, or of those that changed.
template <class Bounds>
void PartTrees<Bounds>::bound_vertices(Core& core, PartId part, Known known, StopSignal stop) {
  const Motion& motion = core.motion.vertices();
  const FeatureRange& features = core.topology->parts[number_of(part)].features;
  const RangeMotion& range = core.motion.range(part);
  const auto bound = [&](std::size_t begin, std::size_t end) {
    point_bounds(motion.vertices().subspan(begin, end - begin), motion.states().subspan(begin, end - begin),
                 motion.frame(), magnitude_, known, core.vertex_bounds.data() + begin);
  };
  if (range.listed && known != Known::kNothing) {
    for (const std::uint32_t v : range.changed) bound(v, v + 1);
  } else if (features.end_vertex - features.first_vertex <= kGrain) {
    bound(features.first_vertex, features.end_vertex);
  } else {
    for_pieces(features.first_vertex, features.end_vertex, kGrain, stop, bound);
  }
}

template <class Bounds>
Refit<Bounds> PartTrees<Bounds>::begin_refit(Core& core, PartId part, StopSignal stop) {
  const Known known = refit_in_[number_of(part)] == kNever     ? Known::kNothing
                      : refit_in_[number_of(part)] < step_ - 1 ? Known::kOlder
                      : from_ == From::kEnd                    ? Known::kLastStep
                                                               : Known::kLastTrial;
  refit_in_[number_of(part)] = step_;
  take_base(part);
  bound_vertices(core, part, known, stop);
  return {{core.topology->scene, core.vertex_bounds, core.motion.vertices().states(), core.motion.range(part),
           magnitude_, known, stop},
          trees_[number_of(part)]};
}

template <class Bounds>
void PartTrees<Bounds>::finish_refit(PartId part, const Refit<Bounds>& refit) {
  const std::size_t changed = refit.finish();
  refit_nodes_ += changed;
  bases_[number_of(part)].left |= changed > 0;
  states_[number_of(part)] =
      trees_[number_of(part)].motion.states.empty() ? 0 : trees_[number_of(part)].motion.states[0];
}

// Puts a part's travel back to that of the base where it left it, or makes it the base's.
template <class Bounds>
void PartTrees<Bounds>::take_base(PartId part) {
  Bvh<Bounds>& tree = trees_[number_of(part)];
  Base& base = bases_[number_of(part)];
  if (from_ == From::kStart && base.of == base_) {
    return_to_base(part);
  } else if (trial_) {
    base.of = base_;
    if (!std::exchange(base.left, false)) return;
    tree.travel.base_nodes.assign(tree.travel.nodes.begin(), tree.travel.nodes.end());
    tree.travel.base_blocks.assign(tree.travel.blocks.begin(), tree.travel.blocks.end());
  }
}

template <class Bounds>
void PartTrees<Bounds>::return_to_base(PartId part) {
  if (bases_[number_of(part)].of != base_ || !std::exchange(bases_[number_of(part)].left, false)) return;
  TreeTravel& travel = trees_[number_of(part)].travel;
  std::ranges::copy(travel.base_nodes, travel.nodes.begin());
  std::ranges::copy(travel.base_blocks, travel.blocks.begin());
}

template <class Bounds>
void PartTrees<Bounds>::return_to_base() {
  for (std::uint32_t p = 0; p < trees_.size(); ++p) return_to_base(PartId{p});
}

template <class Bounds>
std::span<const std::uint8_t> PartTrees<Bounds>::off_base() noexcept {
  std::ranges::transform(bases_, off_base_.begin(), [this](const Base& base) {
    return static_cast<std::uint8_t>(base.of == base_ && base.left ? 1 : 0);
  });
  return off_base_;
}

template <class Bounds>
void PartTrees<Bounds>::bound_vertices(Core& core, StopSignal stop) {
  for (std::uint32_t p = 0; p < trees_.size(); ++p) {
    if (!waits(PartId{p}) && core.motion.range(PartId{p}).any != 0)
      bound_vertices(core, PartId{p}, Known::kLastTrial, stop);
  }
}

template <class Bounds>
void PartTrees<Bounds>::forget_bounds_of_moved() {
  unseen_.resize(states_.size(), 0);
  for (std::uint32_t p = 0; p < states_.size(); ++p) {
    if (states_[p] == 0) continue;
    refit_in_[p] = kNever;
    unseen_[p] = kChanged;
  }
}

template <class Bounds>
bool PartTrees<Bounds>::wait(Core& core, PartId part, ApartParts* apart, bool rebuild) {
  const SceneMotion& motion = core.motion;
  const auto root = [&](const auto&... what) {
    return narrow<Bounds>(
        moving_bounds(what..., motion.vertices().frame(), held_separation(core, part), magnitude_));
  };
  if (core.model.is_removed(part)) {
    states_[number_of(part)] = 0;
    roots_[number_of(part)] = Bounds::empty();
    trees_[number_of(part)] = {};
  } else if (apart != nullptr && apart->small(motion, part) && !core.tests_itself(part)) {
    states_[number_of(part)] = motion.state(part) | unseen(part);
    if (states_[number_of(part)] != 0 || rebuild) roots_[number_of(part)] = root(apart->points(motion, part));
  } else if (motion.unplaced(part)) {
    states_[number_of(part)] = motion.state(part) | unseen(part);
    const SceneMotion::Ball ball = motion.ball(part);
    if (states_[number_of(part)] != 0 || rebuild) roots_[number_of(part)] = root(ball.centre, ball.radius);
  } else {
    return false;
  }
  return true;
}

template <class Bounds>
std::span<const PartId> PartTrees<Bounds>::waiting(std::span<const NearPair> near, StopSignal stop) {
  late_.clear();
  PacedStop paced(stop);
  for (const NearPair& pair : near) {
    paced.check();
    for (const PartId part : {pair.parts.a, pair.parts.b}) {
      if (waits(part)) late_.push_back(part);
    }
  }
  std::ranges::sort(late_);
  late_.erase(std::unique(late_.begin(), late_.end()), late_.end());
  return late_;
}

template <class Bounds>
void PartTrees<Bounds>::leave_waiting() {
  for (std::uint32_t p = 0; p < states_.size(); ++p) {
    if (waits(PartId{p}) && states_[p] != 0) refit_in_[p] = kNever;
  }
}

template <class Bounds>
void PartTrees<Bounds>::take_looseness() {
  for (std::uint32_t p = 0; p < trees_.size(); ++p) {
    if (trees_[p].built_looseness == 0 && !trees_[p].nodes.empty() && !waits(PartId{p}))
      trees_[p].built_looseness = looseness(trees_[p]);
  }
}

template <class Bounds>
void PartTrees<Bounds>::forget_bounds() {
  std::ranges::fill(refit_in_, kNever);
}

template <class Bounds>
std::size_t PartTrees<Bounds>::memory_bytes() const {
  std::size_t bytes = trees_.capacity() * sizeof(Bvh<Bounds>) + roots_.capacity() * sizeof(Bounds) +
                      (states_.capacity() + unseen_.capacity()) * sizeof(MotionState) +
                      refit_in_.capacity() * sizeof(std::int64_t) +
                      (late_.capacity() + rearranged_.capacity()) * sizeof(std::uint32_t) +
                      bases_.capacity() * sizeof(Base) + off_base_.capacity();
  for (const Bvh<Bounds>& tree : trees_) bytes += tree.memory_bytes();
  bytes += changed_.capacity() * sizeof(changed_[0]);
  for (const std::vector<std::uint8_t>& blocks : changed_) bytes += blocks.capacity();
  return bytes;
}

template class PartTrees<Aabb>;
template class PartTrees<KDop18>;

}  // namespace warmfront
