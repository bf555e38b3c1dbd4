// SPDX-License-Identifier: Apache-2.0
// Queries, timed: see query_run.h.
#include "client/cli/query_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

namespace warmfront::client {

TimedVerdict timed_test(const FeatureVertices& features, const ElementaryOptions& options,
                        std::uint32_t rounds, ElementaryCounts& counts) {
  TimedVerdict result;
  std::vector<double> times(std::max(rounds, 1U));
  for (double& time : times) {
    const auto begin = std::chrono::steady_clock::now();
    result.verdict = elementary_test(features, options, counts);
    time = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
  }
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>((times.size() - 1) / 2);
  std::ranges::nth_element(times, middle);
  result.nanoseconds = *middle;
  return result;
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

}  // namespace warmfront::client
