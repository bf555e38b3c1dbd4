// SPDX-License-Identifier: Apache-2.0
// The bounding volume test tree (BVTT), which has a fixed shape. Pure values and functions.
#pragma once

#include "engine/bvh/bvh.h"

namespace warmfront {

/// A BVTT node: a node of each part's hierarchy. For a part against itself, a <= b; a == b is a node against
/// itself.
struct NodePair {
  NodeId a;
  NodeId b;
  friend bool operator==(const NodePair&, const NodePair&) = default;
};

inline NodePair ordered(NodeId x, NodeId y) {
  return x < y ? NodePair{x, y} : NodePair{y, x};
}

/// The BVTT of a part against itself, or of two parts. Its shape depends on the hierarchies' shapes only. For
/// a part against itself, (n, n) opens into (l, l), (r, r), (l, r) with l, r the children of n. Any other (a,
/// b) opens the node nearer its root (the smaller number; a if equal) that is not a leaf, into its children
/// with the other. As a node's number is less than its children's, a path to (a, b) opens the ancestors of
/// both in ascending order, so the last one opened is the greater of the two parents (b's if equal): this
/// makes the parent of a pair computable.
class Bvtt {
 public:
  Bvtt(const TreeShape& a, const TreeShape& b, bool self) : a_(a), b_(b), self_(self) {}

  static constexpr NodePair root() { return {kRoot, kRoot}; }
  static bool is_root(const NodePair& pair) { return pair.a == kRoot && pair.b == kRoot; }

  bool self() const { return self_; }
  /// A node against itself overlaps by definition.
  bool is_self(const NodePair& pair) const { return self_ && pair.a == pair.b; }
  bool is_leaf(const NodePair& pair) const { return a_.is_leaf(pair.a) && b_.is_leaf(pair.b); }

  /// Calls `visit` for the children of `pair`, which must not be a leaf pair, in order.
  template <class Visit>
  void for_children(const NodePair& pair, Visit&& visit) const {
    if (is_self(pair)) {
      const NodeId left = TreeShape::left(pair.a);
      visit(NodePair{left, left});
      visit(NodePair{left + 1, left + 1});
      visit(NodePair{left, left + 1});
    } else if (b_.is_leaf(pair.b) || (pair.a <= pair.b && !a_.is_leaf(pair.a))) {
      const NodeId left = TreeShape::left(pair.a);
      visit(in_order(left, pair.b));
      visit(in_order(left + 1, pair.b));
    } else {
      const NodeId left = TreeShape::left(pair.b);
      visit(in_order(pair.a, left));
      visit(in_order(pair.a, left + 1));
    }
  }

  /// `pair` must not be the root.
  NodePair parent(const NodePair& pair) const {
    if (opened_a(pair)) return in_order(TreeShape::parent(pair.a), pair.b);
    const NodeId of_b = TreeShape::parent(pair.b);
    if (self_ && TreeShape::parent(pair.a) == of_b) return {of_b, of_b};
    return in_order(pair.a, of_b);
  }

  /// Is this the first child of its parent? Never true for a non-self pair with a self pair as parent.
  bool is_first_child(const NodePair& pair) const {
    if (opened_a(pair)) return TreeShape::is_left(pair.a);
    if (self_ && pair.a != pair.b && TreeShape::parent(pair.a) == TreeShape::parent(pair.b)) return false;
    return TreeShape::is_left(pair.b);
  }

 private:
  NodePair in_order(NodeId a, NodeId b) const { return self_ ? ordered(a, b) : NodePair{a, b}; }

  // Was a opened last on the way to the pair, rather than b? For a part against itself b's parent is never
  // the smaller one, because b is not.
  bool opened_a(const NodePair& pair) const {
    if (pair.b == kRoot) return true;
    if (pair.a == kRoot || self_) return false;
    return TreeShape::parent(pair.a) > TreeShape::parent(pair.b);
  }

  const TreeShape& a_;
  const TreeShape& b_;
  const bool self_;
};

}  // namespace warmfront
