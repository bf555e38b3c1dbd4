// SPDX-License-Identifier: Apache-2.0
// Where the front hands over: overlapping leaf pairs go to a sink, one sink a thread.
#pragma once

#include "engine/bvh/bvh.h"

namespace warmfront {

/// Takes leaf pairs as they are found. Used by one thread at a time.
class LeafPairSink {
 public:
  virtual ~LeafPairSink() = default;
  /// Leaves whose bounds overlap, a < b, or a leaf against itself, a == b. Returns how far apart at t = 1 the
  /// nearest two of their primitives are that share no vertex, as separation() measures it; not positive when
  /// some of them overlap then. What met on the way and came apart again need not be met in the next step.
  virtual float leaf_pair(NodeId a, NodeId b) = 0;
};

/// Gives each thread its own sink. Thread-safe.
class LeafPairSinks {
 public:
  virtual ~LeafPairSinks() = default;
  virtual LeafPairSink& local() = 0;
};

}  // namespace warmfront
