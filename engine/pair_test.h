// SPDX-License-Identifier: Apache-2.0
// One pair of features by itself, decided as a collider decides it: for those who find near pairs with a
// broad phase of their own. Pure functions, safe to call from any thread, in any floating-point environment.
#pragma once

#include <array>
#include <optional>

#include "engine/contact.h"
#include "engine/options.h"
#include "engine/result.h"

namespace warmfront {

/// Four vertices that move linearly from `start` (t = 0) to `end` (t = 1), in any one unit: kVertexFace a
/// vertex, then a face's three; kEdgeEdge an edge's two, then another's two. A point in place of an edge is
/// the same vertex twice.
struct MovingPair {
  ContactKind kind;
  std::array<std::array<double, 3>, 4> start;
  std::array<std::array<double, 3>, 4> end;
};

/// As the fields of these names in ColliderOptions and QuestionOptions.
struct PairOptions {
  Tier tier = Tier::kCertified;
  double tolerance = 1e-6;
  double min_separation = 0;
  /// In [0, 1), 0 in tier fast: a pair that starts d apart, beyond min_separation m, is in contact when it
  /// comes within m + keep_distance (d - m); 0: within m. Decided as by max_step().
  double keep_distance = 0;
  /// In [0, 1]: no later contact is told.
  double latest = 1;
};

/// When a pair comes into contact: `toi` as that of a Contact, with its status.
struct PairContact {
  ContactStatus status;
  double toi;

  friend bool operator==(const PairContact&, const PairContact&) = default;
};

/// Does the pair come into contact, and when first? Tiers promise what they promise of a step: certified
/// misses nothing and is never late, exact tells no pair that stays apart. In tier exact, toi is 0 where the
/// pair is within min_separation at t = 0, and else only where the first contact is before the least double.
/// kInvalidArgument for another kind, a coordinate that is not finite (the message names vertex and axis), or
/// options out of range. Allocates nothing but for an error and in tier exact.
Result<std::optional<PairContact>> test_pair(const MovingPair& pair, const PairOptions& options = {});

}  // namespace warmfront
