// SPDX-License-Identifier: Apache-2.0
// The knee: see knee.h.
#include "client/cli/load/knee.h"

#include <cmath>

namespace warmfront::client::load {
namespace {

constexpr double kLeast = 1e-3;
constexpr double kMost = 1e6;

}  // namespace

KneeSearch::KneeSearch(double rate, double precision) : first_(rate), precision_(precision) {}

std::optional<double> KneeSearch::next() const {
  if (!held_ && !failed_) return first_;
  if (!failed_) return *held_ >= kMost * first_ ? std::nullopt : std::optional(2 * *held_);
  if (!held_) return *failed_ <= kLeast * first_ ? std::nullopt : std::optional(*failed_ / 2);
  return *failed_ <= precision_ * *held_ ? std::nullopt : std::optional(std::sqrt(*held_ * *failed_));
}

void KneeSearch::tried(bool held) {
  const std::optional<double> rate = next();
  if (rate) (held ? held_ : failed_) = rate;
}

}  // namespace warmfront::client::load
