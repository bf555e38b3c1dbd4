// SPDX-License-Identifier: Apache-2.0
// Queries, timed: see query_run.h.
#include "client/cli/queries/query_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

namespace warmfront::client {

std::vector<TypedQuery> all_queries(std::span<const QueryFile> files) {
  std::vector<TypedQuery> all;
  for (const QueryFile& file : files) {
    for (const KnownQuery& query : file.queries) all.push_back({file.kind, query});
  }
  return all;
}

std::vector<TimedVerdict> run_timed(std::span<const TypedQuery> queries, const ElementaryOptions& options,
                                    std::uint32_t rounds,
                                    const std::function<void(std::uint64_t)>& progress) {
  using Clock = std::chrono::steady_clock;
  constexpr std::uint64_t kProgressInterval = 256;
  std::vector<TimedVerdict> results(queries.size());
  if (queries.empty()) return results;
  ElementaryCounts counts;
  // Warm-up, so that the first query's time does not include loading the code.
  elementary_test(queries.front().features(), options, counts);
  rounds = std::max(rounds, 1U);
  std::vector<double> times(rounds * queries.size());  // grouped by query
  std::uint64_t done = 0;
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const auto begin = Clock::now();
      results[i].verdict = elementary_test(queries[i].features(), options, counts);
      times[i * rounds + round] = std::chrono::duration<double, std::nano>(Clock::now() - begin).count();
      if (++done % kProgressInterval == 0) progress(done);
    }
  }
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto own = times.begin() + static_cast<std::ptrdiff_t>(i * rounds);
    results[i].nanoseconds = median({own, own + rounds});
  }
  return results;
}

void QueryTally::add(const Verdict& verdict, bool truth) {
  ++queries;
  contacts += truth;
  false_positives += verdict.contact && !truth;
  false_negatives += !verdict.contact && truth;
  possible += is_undecided(verdict);
}

QueryTally& QueryTally::operator+=(const QueryTally& more) {
  queries += more.queries;
  contacts += more.contacts;
  false_positives += more.false_positives;
  false_negatives += more.false_negatives;
  possible += more.possible;
  return *this;
}

Times times_of(std::vector<double> nanoseconds) {
  if (nanoseconds.empty()) return {};
  std::ranges::sort(nanoseconds);
  const auto count = static_cast<double>(nanoseconds.size());
  return {std::accumulate(nanoseconds.begin(), nanoseconds.end(), 0.0) / count,
          nanoseconds[static_cast<std::size_t>(std::ceil(0.99 * count)) - 1], nanoseconds.back()};
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace warmfront::client
