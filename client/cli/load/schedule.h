// SPDX-License-Identifier: Apache-2.0
// Due times of frames. Each session has its own schedule. Not thread-safe.
#pragma once

#include <cstdint>
#include <random>
#include <string_view>

namespace warmfront::client::load {

enum class Arrival : std::uint8_t {
  kClosed,    ///< a frame when the previous answer has arrived, like a simulation
  kConstant,  ///< a fixed rate, independent of the answers
  kPoisson,   ///< random gaps with a fixed mean rate, like many independent clients
};
std::string_view to_string(Arrival arrival);

/// The due times of an open loop. During the ramp the rate grows linearly from 0.
class Schedule {
 public:
  /// `rate` frames a second, > 0; `ramp` seconds, >= 0. `phase` in [0, 1) shifts a constant schedule by this
  /// fraction of a period; `seed` determines the gaps of a Poisson one.
  Schedule(Arrival arrival, double rate, double ramp, double phase, std::uint64_t seed);

  /// Seconds from the start, ascending.
  double next();

 private:
  Arrival arrival_;
  double rate_;
  double ramp_;
  double due_;  // the next frame's position in the expected number of frames since the start
  std::mt19937_64 random_;
};

}  // namespace warmfront::client::load
