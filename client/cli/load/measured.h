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
  // At its end, sessions whose last call did not succeed, by why.
  std::uint32_t without_daemon = 0;  ///< none answers
  std::uint32_t refused = 0;         ///< one does, and refuses
  double unserved_since = 0;         ///< the longest of these, seconds from the start
};

/// The result of a plan.
struct Measured {
  Plan plan;
  Tally tally;
  double seconds = 0;           ///< measured: plan.duration, or less after an interrupt
  double client_cpu_cores = 0;  ///< used by this process meanwhile
  double unserved_seconds = 0;  ///< of the measured ones, in which no session had a daemon that served it
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
  /// For how long no session was served, and what that does to the rates; empty where it was not so.
  std::string outage() const;
};

}  // namespace warmfront::client::load
