// SPDX-License-Identifier: Apache-2.0
// Due times. Thread safety as stated in the header.
#include "client/cli/load/schedule.h"

#include <cmath>

namespace warmfront::client::load {

std::string_view to_string(Arrival arrival) {
  switch (arrival) {
    case Arrival::kClosed:
      return "closed";
    case Arrival::kConstant:
      return "constant";
    case Arrival::kPoisson:
      return "poisson";
  }
  return "";
}

Schedule::Schedule(Arrival arrival, double rate, double ramp, double phase, std::uint64_t seed)
    : arrival_(arrival), rate_(rate), ramp_(ramp), due_(phase), random_(seed) {}

double Schedule::next() {
  if (arrival_ == Arrival::kPoisson) {
    // Not std::exponential_distribution, whose numbers differ from library to library.
    const double uniform = std::ldexp(static_cast<double>(random_() >> 11), -53);
    due_ += -std::log1p(-uniform);
  }
  const double frames = due_;
  if (arrival_ != Arrival::kPoisson) due_ += 1;
  // The time at which the expected number of frames is reached: rate * t^2 / (2 ramp) up to the ramp's end,
  // and rate * (t - ramp / 2) after it.
  const double in_ramp = rate_ * ramp_ / 2;
  return frames < in_ramp ? std::sqrt(2 * ramp_ * frames / rate_) : frames / rate_ + ramp_ / 2;
}

}  // namespace warmfront::client::load
