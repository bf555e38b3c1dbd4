// SPDX-License-Identifier: Apache-2.0
// Buckets and quantiles. Thread safety as stated in the header.
#include "client/cli/load/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

namespace warmfront::client::load {
namespace {

constexpr std::uint64_t kExact = 128;  // nanoseconds with a bucket each
constexpr int kExactBits = 7;
constexpr std::uint64_t kPerOctave = kExact / 2;
constexpr double kMostNanoseconds = 365.0 * 86400 * 1e9;
constexpr double kNanoseconds = 1e6;  // in a millisecond

std::size_t bucket_of(std::uint64_t ns) {
  if (ns < kExact) return ns;
  const int shift = static_cast<int>(std::bit_width(ns)) - kExactBits;
  return kExact + static_cast<std::size_t>(shift - 1) * kPerOctave + (ns >> shift) - kPerOctave;
}

double middle_of(std::size_t bucket) {
  if (bucket < kExact) return static_cast<double>(bucket);
  const std::size_t octave = (bucket - kExact) / kPerOctave;
  const auto lowest = static_cast<double>(kPerOctave + (bucket - kExact) % kPerOctave);
  return std::ldexp(lowest + 0.5, static_cast<int>(octave) + 1);
}

}  // namespace

void Histogram::record(double ms) {
  ms = std::clamp(ms, 0.0, kMostNanoseconds / kNanoseconds);
  const std::size_t bucket = bucket_of(static_cast<std::uint64_t>(ms * kNanoseconds));
  if (bucket >= buckets_.size()) buckets_.resize(bucket + 1);
  ++buckets_[bucket];
  min_ms_ = count_ == 0 ? ms : std::min(min_ms_, ms);
  max_ms_ = std::max(max_ms_, ms);
  sum_ms_ += ms;
  ++count_;
}

void Histogram::merge(const Histogram& other) {
  if (other.count_ == 0) return;
  if (other.buckets_.size() > buckets_.size()) buckets_.resize(other.buckets_.size());
  for (std::size_t b = 0; b < other.buckets_.size(); ++b) buckets_[b] += other.buckets_[b];
  min_ms_ = count_ == 0 ? other.min_ms_ : std::min(min_ms_, other.min_ms_);
  max_ms_ = std::max(max_ms_, other.max_ms_);
  sum_ms_ += other.sum_ms_;
  count_ += other.count_;
}

void Histogram::clear() {
  std::vector<std::uint64_t> buckets = std::move(buckets_);
  std::ranges::fill(buckets, 0);
  *this = {};
  buckets_ = std::move(buckets);
}

double Histogram::quantile(double q) const {
  if (count_ == 0) return 0;
  const double rank = std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_));
  if (rank >= static_cast<double>(count_)) return max_ms_;
  std::uint64_t seen = 0;
  for (std::size_t b = 0; b < buckets_.size(); ++b) {
    seen += buckets_[b];
    if (static_cast<double>(seen) >= std::max(rank, 1.0))
      return std::clamp(middle_of(b) / kNanoseconds, min_ms_, max_ms_);
  }
  return max_ms_;
}

}  // namespace warmfront::client::load
