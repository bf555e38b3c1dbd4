// SPDX-License-Identifier: Apache-2.0
// Elementary queries with known answers through one tier, counted and timed one by one. One thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/io/query_file.h"
#include "engine/elementary/elementary_test.h"

namespace warmfront::client {

/// A verdict, and the median of the times it took.
struct TimedVerdict {
  Verdict verdict;
  double nanoseconds = 0;
};

/// Tests the primitives `rounds` times (at least once), each timed by itself, the clock's own time included.
TimedVerdict timed_test(const FeatureVertices& features, const ElementaryOptions& options,
                        std::uint32_t rounds, ElementaryCounts& counts);

/// Whether a verdict leaves open if the primitives touch.
inline bool is_undecided(const Verdict& verdict) {
  return verdict.contact &&
         (verdict.status == ContactStatus::kPossible || verdict.status == ContactStatus::kBudget);
}

/// The sums over queries of one kind. A contact is answered by any status; reported where there is none it is
/// a false positive, not reported where there is one a false negative.
struct QueryTally {
  std::uint64_t queries = 0;
  std::uint64_t contacts = 0;  ///< in truth
  std::uint64_t false_positives = 0;
  std::uint64_t false_negatives = 0;
  std::uint64_t possible = 0;  ///< undecided answers, true or not

  void add(const Verdict& verdict, bool truth);
  QueryTally& operator+=(const QueryTally& more);
};

/// Mean, 99th percentile and maximum; 0 for nothing.
struct Times {
  double mean = 0;
  double p99 = 0;
  double max = 0;
};
Times times_of(std::vector<double> nanoseconds);

}  // namespace warmfront::client
