// SPDX-License-Identifier: Apache-2.0
#include "engine/broad_phase/near_parts.h"

#include <algorithm>

#include "engine/bounds/overlap.h"

namespace warmfront {
namespace {

template <class Bounds>
double middle(const Bounds& bounds, int axis) {
  return double{bounds.lower(axis)} + double{bounds.upper(axis)};
}

}  // namespace

// Splits by world first, then the static parts off, then by the widest axis of the centres, as the parts' own
// hierarchies do.
template <class Bounds>
void NearParts<Bounds>::order(const CollisionModel& model, std::span<const Bounds> roots, NodeId node,
                              StopSignal stop) {
  if (shape_.is_leaf(node)) return;
  stop.check();
  PacedStop paced(stop);
  const NodeId first = TreeShape::left(node);
  const auto begin = order_.begin() + shape_.begin(node);
  const auto half = order_.begin() + shape_.end(first);
  const auto end = order_.begin() + shape_.end(node);
  const auto is_static = [&](PartId part) {
    paced.check();
    return model.is_static(part);
  };
  const auto other_world = [&](PartId part) {
    paced.check();
    return model.world_of(part) != model.world_of(*begin);
  };
  if (std::any_of(begin, end, other_world)) {
    std::nth_element(begin, half, end, [&](PartId p, PartId q) {
      paced.check();
      const std::uint32_t of_p = model.world_of(p);
      const std::uint32_t of_q = model.world_of(q);
      return of_p != of_q ? of_p < of_q : p < q;
    });
  } else if (std::any_of(begin, end, is_static) && !std::all_of(begin, end, is_static)) {
    std::nth_element(begin, half, end,
                     [&](PartId p, PartId q) { return is_static(p) != is_static(q) ? is_static(p) : p < q; });
  } else {
    int widest = 0;
    double width = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [lo, hi] = std::minmax_element(begin, end, [&](PartId p, PartId q) {
        paced.check();
        return middle(roots[number_of(p)], axis) < middle(roots[number_of(q)], axis);
      });
      const double extent = middle(roots[number_of(*hi)], axis) - middle(roots[number_of(*lo)], axis);
      if (extent > width) {
        width = extent;
        widest = axis;
      }
    }
    std::nth_element(begin, half, end, [&](PartId p, PartId q) {
      paced.check();
      const double x = middle(roots[number_of(p)], widest);
      const double y = middle(roots[number_of(q)], widest);
      return x != y ? x < y : p < q;
    });
  }
  order(model, roots, first, stop);
  order(model, roots, TreeShape::right(node), stop);
}

template <class Bounds>
void NearParts<Bounds>::arrange(const CollisionModel& model, std::span<const Bounds> roots, StopSignal stop) {
  order_.clear();
  for (PartId p{0}; p < model.end_part(); ++p) {
    // Unbounded parts have no centre: they overlap all others at any position in the order.
    if (!model.is_removed(p)) order_.push_back(p);
  }
  shape_ = TreeShape(static_cast<std::uint32_t>(order_.size()), 1);
  nodes_.resize(order_.empty() ? 0 : shape_.node_count());
  const bool placed = std::ranges::all_of(order_, [&](PartId p) {
    const Bounds& root = roots[number_of(p)];
    const double sum = middle(root, 0) + middle(root, 1) + middle(root, 2);
    return sum - sum == 0;
  });
  if (!order_.empty() && placed) order(model, roots, kRoot, stop);
}

template <class Bounds>
void NearParts<Bounds>::refit(const CollisionModel& model, std::span<const Bounds> roots,
                              std::span<const std::uint8_t> changed) {
  for (auto i = static_cast<std::uint32_t>(nodes_.size()); i-- > 0;) {
    const NodeId node{i};
    Node& to = nodes_[i];
    if (!shape_.is_leaf(node)) {
      const Node& left = nodes_[number_of(TreeShape::left(node))];
      const Node& right = nodes_[number_of(TreeShape::right(node))];
      to = left;
      to.bounds.merge(right.bounds);
      to.set.add(right.set);
      to.changed |= right.changed;
    } else {
      const PartId part = order_[shape_.begin(node)];
      to = {roots[number_of(part)], model.set_of(part), changed[number_of(part)] != 0};
    }
  }
}

template <class Bounds>
double NearParts<Bounds>::looseness() const {
  double sum = 0;
  if (nodes_.empty()) return 0;
  for (NodeId node = kRoot; node < shape_.first_leaf(); ++node)
    sum += nodes_[number_of(node)].bounds.extent();
  const double root = nodes_.front().bounds.extent();
  return root > 0 ? sum / root : 0;
}

template <class Bounds>
void NearParts<Bounds>::traverse(const CollisionModel& model, std::span<const std::uint8_t> changed,
                                 bool rebuild, std::size_t most, StopSignal stop, std::uint64_t& bv_tests) {
  const Bvtt bvtt(shape_, shape_, true);
  PacedStop paced(stop);
  while (!stack_.empty() && near_.size() <= most) {
    paced.check();
    const NodePair pair = stack_.back();
    stack_.pop_back();
    const Node& a = nodes_[number_of(pair.a)];
    const Node& b = nodes_[number_of(pair.b)];
    if ((!rebuild && !a.changed && !b.changed) || !a.set.may_meet(b.set)) continue;
    const bool self = pair.a == pair.b;
    if (self && shape_.is_leaf(pair.a)) continue;
    if (!self) {
      ++bv_tests;
      if (!overlap(a.bounds, b.bounds)) continue;
    }
    if (!bvtt.is_leaf(pair)) {
      bvtt.for_children(pair, [&](const NodePair& child) { stack_.push_back(child); });
      continue;
    }
    const PartId p = order_[shape_.begin(pair.a)];
    const PartId q = order_[shape_.begin(pair.b)];
    if (model.may_meet(p, q))
      near_.push_back(
          {{std::min(p, q), std::max(p, q)}, changed[number_of(p)] == 0 && changed[number_of(q)] == 0});
  }
}

template <class Bounds>
void NearParts<Bounds>::sort(StopSignal stop) {
  PacedStop paced(stop);
  std::ranges::sort(near_, [&](const NearPair& x, const NearPair& y) {
    paced.check();
    return x.parts < y.parts;
  });
}

template <class Bounds>
std::span<const NearPair> NearParts<Bounds>::find(const CollisionModel& model, std::span<const Bounds> roots,
                                                  std::span<const std::uint8_t> changed, bool rebuild,
                                                  std::uint64_t& bv_tests, std::size_t most,
                                                  StopSignal stop) {
  constexpr double kLoosenessLimit = 1.5;
  last_.clear();
  if (!rebuild) last_.swap(near_);
  near_.clear();
  overflowed_ = false;
  const bool first = rebuild || nodes_.empty();
  if (first) arrange(model, roots, stop);
  refit(model, roots, changed);
  if (first || looseness() > kLoosenessLimit * built_looseness_) {
    arrange(model, roots, stop);
    refit(model, roots, changed);
    built_looseness_ = looseness();
  }

  for (const NearPair& pair : last_) {
    if (changed[number_of(pair.parts.a)] == 0 && changed[number_of(pair.parts.b)] == 0)
      near_.push_back({pair.parts, true});
  }
  for (const PartId p : order_) {
    if (model.self_collision(p) && (rebuild || changed[number_of(p)] != 0))
      near_.push_back({{p, p}, changed[number_of(p)] == 0});
  }
  stack_.clear();
  if (!nodes_.empty()) stack_.push_back(Bvtt::root());
  const std::uint64_t tests_before = bv_tests;
  // The memory for a part with itself is within the part's own.
  const std::size_t allowed = most < ~std::size_t{0} - order_.size() ? most + order_.size() : most;
  traverse(model, changed, rebuild, allowed, stop, bv_tests);
  if (near_.size() > allowed) {
    overflowed_ = true;
    bv_tests = tests_before;  // the tests are repeated
    std::vector<NearPair>().swap(near_);
    std::vector<NearPair>().swap(last_);
    stack_.assign(1, Bvtt::root());
    next_self_ = 0;
    return {};
  }
  sort(stop);
  return near_;
}

template <class Bounds>
std::span<const NearPair> NearParts<Bounds>::next_block(const CollisionModel& model,
                                                        std::span<const std::uint8_t> changed,
                                                        std::uint64_t& bv_tests, StopSignal stop) {
  near_.clear();
  near_.reserve(kBlock + 1);
  for (; next_self_ < order_.size() && near_.size() < kBlock; ++next_self_) {
    const PartId p = order_[next_self_];
    if (model.self_collision(p)) near_.push_back({{p, p}, changed[number_of(p)] == 0});
  }
  traverse(model, changed, true, kBlock - 1, stop, bv_tests);
  sort(stop);
  return near_;
}

template class NearParts<Aabb>;
template class NearParts<KDop18>;

}  // namespace warmfront
