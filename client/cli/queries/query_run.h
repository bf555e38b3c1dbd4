// SPDX-License-Identifier: Apache-2.0
// Elementary queries through one tier, counted and timed one by one. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "client/io/query_file.h"
#include "engine/elementary/elementary_test.h"

namespace warmfront::client {

/// A query with its kind.
struct TypedQuery {
  ContactKind kind = ContactKind::kVertexFace;
  KnownQuery query;
  FeatureVertices features() const { return query.features(kind); }
};

/// All files' queries in one list.
std::vector<TypedQuery> all_queries(std::span<const QueryFile> files);

/// A verdict, and the median of its times.
struct TimedVerdict {
  Verdict verdict;
  double nanoseconds = 0;
};

/// Tests all queries, `rounds` times (at least once); each test is timed on its own, including the clock's
/// own time. A round runs through all of them, so that no query runs with caches warmed by itself. Calls
/// `progress` with the number of tests done, of rounds * queries.
std::vector<TimedVerdict> run_timed(std::span<const TypedQuery> queries, const ElementaryOptions& options,
                                    std::uint32_t rounds, const std::function<void(std::uint64_t)>& progress);

/// Does a verdict leave open whether the primitives touch?
inline bool is_undecided(const Verdict& verdict) {
  return verdict.contact &&
         (verdict.status == ContactStatus::kPossible || verdict.status == ContactStatus::kBudget);
}

/// Sums over queries. An answer of any status is a contact; it is a false positive if the truth is no
/// contact, and no answer for a true contact is a false negative.
struct QueryTally {
  std::uint64_t queries = 0;
  std::uint64_t contacts = 0;  ///< true contacts
  std::uint64_t false_positives = 0;
  std::uint64_t false_negatives = 0;
  std::uint64_t possible = 0;  ///< undecided answers, right or wrong

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

/// The median, the lower one of two; `values` must not be empty.
double median(std::vector<double> values);

}  // namespace warmfront::client
