// SPDX-License-Identifier: Apache-2.0
// The result of a load. Plain values and pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/load/plan.h"
#include "client/cli/load/tally.h"

namespace warmfront::client::load {

/// One second, or the last fraction of one.
struct Second {
  double at = 0;  ///< its end, seconds from the start; the ramp and warm-up are included
  double seconds = 1;
  std::uint64_t frames = 0;
  std::uint64_t contacts = 0;
  std::uint64_t errors = 0;
  double p50_ms = 0;
  double p99_ms = 0;
};

/// The result of a plan.
struct Measured {
  Plan plan;
  Tally tally;
  double seconds = 0;           ///< measured: plan.duration, or less after an interrupt
  double client_cpu_cores = 0;  ///< used by this process meanwhile
  bool interrupted = false;
  std::uint32_t sessions_missing = 0;  ///< at the end: never created, or lost and not recovered
  std::string why_missing;             ///< the error of one of them
  std::vector<Second> series;

  double frames_per_second() const { return seconds > 0 ? static_cast<double>(tally.frames) / seconds : 0; }
  double contacts_per_second() const {
    return seconds > 0 ? static_cast<double>(tally.contacts) / seconds : 0;
  }
  /// Open loop: the fraction of due frames that was sent before the end.
  double kept_pace() const;
  /// Why this process, and not the daemon, may limit the figures; empty without a sign of it.
  std::string client_limit() const;
};

}  // namespace warmfront::client::load
