// SPDX-License-Identifier: Apache-2.0
// Nodes of the bounding volume test tree (BVTT), and its fixed shape. Pure values and functions.
#pragma once

#include <utility>

#include "engine/bvh/bvh.h"

namespace warmfront {

/// A BVTT node: a pair of hierarchy nodes, a <= b, or one node against itself (a == b).
///
/// The BVTT's shape depends on the hierarchy's shape alone. (n, n) opens into (l, l), (r, r), (l, r) with l,
/// r the children of n. (a, b) with a < b opens a, the node nearer the root (or equally near), into its
/// children with b. As a node's number is less than its children's, a path to (a, b) opens the ancestors of
/// both in ascending order, so the last one opened is the greater of the two parents: that makes the parent
/// of a pair computable.
struct NodePair {
  NodeId a;
  NodeId b;
  friend bool operator==(const NodePair&, const NodePair&) = default;
};

inline NodePair ordered(NodeId x, NodeId y) {
  return x < y ? NodePair{x, y} : NodePair{y, x};
}

inline NodePair parent(const NodePair& pair) {
  const NodeId of_a = TreeShape::parent(pair.a);
  const NodeId of_b = TreeShape::parent(pair.b);
  if (of_a == of_b) return {of_a, of_b};
  return ordered(of_b, pair.a);  // of_b > of_a
}

/// Is this the first child of its parent? Pairs that have a self pair as parent and are no self pair never
/// are.
inline bool is_first_child(const NodePair& pair) {
  const NodeId opened_into = pair.b;
  if (pair.a != pair.b && TreeShape::parent(pair.a) == TreeShape::parent(pair.b)) return false;
  return TreeShape::is_left(opened_into);
}

inline bool is_root(const NodePair& pair) {
  return pair.b == 0;
}

}  // namespace warmfront
