// SPDX-License-Identifier: Apache-2.0
// The search for the highest rate that keeps a limit: doubled until it fails (halved while it does not hold),
// then bisected. Knows nothing of what is measured. Not thread-safe.
#pragma once

#include <optional>

namespace warmfront::client::load {

class KneeSearch {
 public:
  /// Starts at `rate` > 0; ends when the lowest rate that failed is at most `precision` (> 1) times the
  /// highest that held, or when a thousandth of the first rate still fails, or a million times it still
  /// holds.
  explicit KneeSearch(double rate, double precision = 1.05);

  /// The rate to try next; none when the search is over.
  std::optional<double> next() const;
  /// The rate of next() was tried.
  void tried(bool held);

  /// The highest rate that held, below all that failed; none so far.
  std::optional<double> highest_held() const { return held_; }
  std::optional<double> lowest_failed() const { return failed_; }

 private:
  double first_;
  double precision_;
  std::optional<double> held_;
  std::optional<double> failed_;
};

}  // namespace warmfront::client::load
