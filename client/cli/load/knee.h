// SPDX-License-Identifier: Apache-2.0
// Search for the highest rate that meets a limit: doubled until it fails (halved while it fails), then
// bisected. Independent of the measured quantity. Not thread-safe.
#pragma once

#include <optional>

namespace warmfront::client::load {

class KneeSearch {
 public:
  /// Starts at `rate` > 0; ends when the lowest failed rate is at most `precision` (> 1) times the highest
  /// passed one, when a thousandth of the first rate still fails, or when a million times it still passes.
  explicit KneeSearch(double rate, double precision = 1.05);

  /// The rate to try next; none when the search is over.
  std::optional<double> next() const;
  /// Reports the result for the rate of next().
  void tried(bool held);

  /// The highest passed rate, below all failed ones; none so far.
  std::optional<double> highest_held() const { return held_; }
  std::optional<double> lowest_failed() const { return failed_; }

 private:
  double first_;
  double precision_;
  std::optional<double> held_;
  std::optional<double> failed_;
};

}  // namespace warmfront::client::load
