// SPDX-License-Identifier: Apache-2.0
#include "engine/broad_phase/near_parts.h"

#include <algorithm>
#include <atomic>
#include <bit>

#include "engine/bounds/overlap.h"
#include "engine/parallel/stoppable_loops.h"

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
  constexpr std::ptrdiff_t kSerialBelow = 1024;
  const auto left = [&] { order(model, roots, first, stop); };
  const auto right = [&] { order(model, roots, TreeShape::right(node), stop); };
  if (end - begin >= kSerialBelow) return fork_two(left, right);
  left();
  right();
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
void NearParts<Bounds>::refit(NodeId node, const CollisionModel& model, std::span<const Bounds> roots,
                              std::span<const std::uint8_t> changed) {
  Node& to = nodes_[number_of(node)];
  if (shape_.is_leaf(node)) {
    const PartId part = order_[shape_.begin(node)];
    to = {roots[number_of(part)], model.set_of(part), changed[number_of(part)] != 0};
    return;
  }
  const Node& left = nodes_[number_of(TreeShape::left(node))];
  const Node& right = nodes_[number_of(TreeShape::right(node))];
  to = left;
  to.bounds.merge(right.bounds);
  to.set.add(right.set);
  to.changed |= right.changed;
}

// Level by level, from the deepest: the children of a level's nodes, [2^k - 1, 2^(k + 1) - 1), are in the next.
template <class Bounds>
void NearParts<Bounds>::refit(const CollisionModel& model, std::span<const Bounds> roots,
                              std::span<const std::uint8_t> changed) {
  constexpr std::size_t kSerial = 256;  // levels of so few nodes together
  std::size_t end = nodes_.size();
  while (end > kSerial) {
    const std::size_t first = std::bit_floor(end) - 1;
    for_each_index(
        first, end, {}, [&](std::size_t i) { refit(NodeId(i), model, roots, changed); }, kSerial);
    end = first;
  }
  while (end-- > 0) refit(NodeId(end), model, roots, changed);
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
void NearParts<Bounds>::look(const Parts& parts, const NodePair& pair, std::vector<NodePair>& next,
                             Found& found) const {
  const Node& a = nodes_[number_of(pair.a)];
  const Node& b = nodes_[number_of(pair.b)];
  if ((!parts.rebuild && !a.changed && !b.changed) || !a.set.may_meet(b.set)) return;
  const bool self = pair.a == pair.b;
  if (self && shape_.is_leaf(pair.a)) return;
  if (!self) {
    ++found.bv_tests;
    if (!overlap(a.bounds, b.bounds)) return;
  }
  if (!Bvtt(shape_, shape_, true).is_leaf(pair)) return next.push_back(pair);
  const PartId p = order_[shape_.begin(pair.a)];
  const PartId q = order_[shape_.begin(pair.b)];
  if (parts.model.may_meet(p, q))
    found.near.push_back({{std::min(p, q), std::max(p, q)},
                          parts.changed[number_of(p)] == 0 && parts.changed[number_of(q)] == 0});
}

// Children are looked at before they are kept: most end there.
template <class Bounds>
void NearParts<Bounds>::look_at_children(const Parts& parts, const NodePair& pair,
                                         std::vector<NodePair>& next, Found& found) const {
  Bvtt(shape_, shape_, true).for_children(pair, [&](const NodePair& child) {
    look(parts, child, next, found);
  });
}

template <class Bounds>
template <class Enough>
void NearParts<Bounds>::traverse(const Parts& parts, std::vector<NodePair>& stack, Found& found,
                                 StopSignal stop, const Enough& enough) const {
  PacedStop paced(stop);
  while (!stack.empty() && !enough(found)) {
    paced.check();
    const NodePair pair = stack.back();
    stack.pop_back();
    look_at_children(parts, pair, stack, found);
  }
}

// The pairs, and the number of tests, are the same in any order, unless there are too many: then neither counts.
template <class Bounds>
void NearParts<Bounds>::traverse_all(const Parts& parts, std::size_t most, StopSignal stop) {
  constexpr std::size_t kTasks = 64;
  stack_.clear();
  if (!nodes_.empty()) look(parts, Bvtt::root(), stack_, found_);
  while (!stack_.empty() && stack_.size() < kTasks) {
    level_.clear();
    for (const NodePair& pair : stack_) look_at_children(parts, pair, level_, found_);
    stack_.swap(level_);
  }
  if (stack_.empty()) return;

  tasks_.resize(kTasks);
  std::atomic<std::size_t> total = found_.near.size();
  fork_each(std::size_t{0}, kTasks, [&](std::size_t t) {
    Task& task = tasks_[t];
    task.stack.clear();
    task.found.near.clear();
    task.found.bv_tests = 0;
    for (std::size_t i = t; i < stack_.size(); i += kTasks) task.stack.push_back(stack_[i]);
    std::size_t counted = 0;
    traverse(parts, task.stack, task.found, stop, [&](const Found& found) {
      if (found.near.size() == counted) return false;
      const std::size_t more = found.near.size() - counted;
      counted = found.near.size();
      return total.fetch_add(more, std::memory_order_relaxed) + more > most;
    });
  });
  for (const Task& task : tasks_) {
    found_.near.insert(found_.near.end(), task.found.near.begin(), task.found.near.end());
    found_.bv_tests += task.found.bv_tests;
  }
}

template <class Bounds>
void NearParts<Bounds>::sort(StopSignal stop) {
  sort_in_parallel(found_.near, stop,
                   [](const NearPair& x, const NearPair& y) { return x.parts < y.parts; });
}

template <class Bounds>
std::span<const NearPair> NearParts<Bounds>::find(const CollisionModel& model, std::span<const Bounds> roots,
                                                  std::span<const std::uint8_t> changed, bool rebuild,
                                                  std::uint64_t& bv_tests, std::size_t most,
                                                  StopSignal stop) {
  constexpr double kLoosenessLimit = 1.5;
  std::vector<NearPair>& near = found_.near;
  last_.clear();
  if (!rebuild) last_.swap(near);
  near.clear();
  found_.bv_tests = 0;
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
      near.push_back({pair.parts, true});
  }
  for (const PartId p : order_) {
    if (model.self_collision(p) && (rebuild || changed[number_of(p)] != 0))
      near.push_back({{p, p}, changed[number_of(p)] == 0});
  }
  // The memory for a part with itself is within the part's own.
  const std::size_t allowed = most < ~std::size_t{0} - order_.size() ? most + order_.size() : most;
  traverse_all({model, changed, rebuild}, allowed, stop);
  if (near.size() > allowed) {  // the tests are repeated
    overflowed_ = true;
    std::vector<NearPair>().swap(near);
    std::vector<NearPair>().swap(last_);
    std::vector<Task>().swap(tasks_);
    stack_.assign(1, Bvtt::root());
    next_self_ = 0;
    return {};
  }
  bv_tests += found_.bv_tests;
  sort(stop);
  return near;
}

template <class Bounds>
std::span<const NearPair> NearParts<Bounds>::next_block(const CollisionModel& model,
                                                        std::span<const std::uint8_t> changed,
                                                        std::uint64_t& bv_tests, StopSignal stop) {
  std::vector<NearPair>& near = found_.near;
  near.clear();
  near.reserve(kBlock + 4);  // a pair has as many children
  for (; next_self_ < order_.size() && near.size() < kBlock; ++next_self_) {
    const PartId p = order_[next_self_];
    if (model.self_collision(p)) near.push_back({{p, p}, changed[number_of(p)] == 0});
  }
  found_.bv_tests = 0;
  traverse({model, changed, true}, stack_, found_, stop,
           [](const Found& found) { return found.near.size() >= kBlock; });
  bv_tests += found_.bv_tests;
  sort(stop);
  return near;
}

template <class Bounds>
std::size_t NearParts<Bounds>::memory_bytes() const {
  std::size_t bytes = held_bytes(found_.near, last_, stack_, level_, nodes_, order_, tasks_);
  for (const Task& task : tasks_) bytes += held_bytes(task.stack, task.found.near);
  return bytes;
}

template class NearParts<Aabb>;
template class NearParts<KDop18>;

}  // namespace warmfront
