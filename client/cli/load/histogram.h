// SPDX-License-Identifier: Apache-2.0
// Logarithmic histogram of durations: quantiles of any number of them in a few kilobytes. After HdrHistogram
// (Gil Tene): each power of two in equally many linear buckets. Not thread-safe.
#pragma once

#include <cstdint>
#include <vector>

namespace warmfront::client::load {

class Histogram {
 public:
  /// Largest error of quantile(); below 128 ns it is a nanosecond instead.
  static constexpr double kRelativeError = 1.0 / 128;

  /// Negative durations count as 0; those above a year as a year.
  void record(double ms);
  void merge(const Histogram& other);
  /// Forgets what was recorded, and keeps the memory: to record the same again takes none.
  void clear();

  std::uint64_t count() const { return count_; }
  double sum_ms() const { return sum_ms_; }
  double mean_ms() const { return count_ == 0 ? 0 : sum_ms_ / static_cast<double>(count_); }
  double max_ms() const { return max_ms_; }
  /// The least duration that is not exceeded by a fraction q of all, q in [0, 1]; quantile(1) is max_ms()
  /// exactly. 0 when nothing was recorded.
  double quantile(double q) const;

 private:
  std::vector<std::uint64_t> buckets_;  // as many as were needed so far
  std::uint64_t count_ = 0;
  double sum_ms_ = 0;
  double min_ms_ = 0;
  double max_ms_ = 0;
};

}  // namespace warmfront::client::load
