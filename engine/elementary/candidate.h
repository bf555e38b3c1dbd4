// SPDX-License-Identifier: Apache-2.0
// The test of Report::kCandidates: moving bounds alone. Pure functions, safe to call from any thread in the
// default floating-point environment (Workers checks it).
#pragma once

#include "engine/elementary/query.h"
#include "engine/elementary/verdict.h"

namespace warmfront {

/// Could the primitives come within `min_separation` (0: touch) during the step, as far as their moving
/// 18-DOPs tell? The first stage of certified_test(): false only if one of nine directions keeps them apart
/// at every time. Status kBudget, undecided; toi is the earliest time that no direction excludes.
inline Verdict candidate_test(const FeatureVertices& features, double min_separation) {
  const Query query = Query::prepare(features, min_separation);
  Window window;
  if (query.size > 0 && !trim_by_kdop(query, window)) return {};
  return {true, ContactStatus::kBudget, window.begin};
}

}  // namespace warmfront
