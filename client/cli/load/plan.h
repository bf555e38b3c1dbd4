// SPDX-License-Identifier: Apache-2.0
// One load: sessions, rate and duration. Plain values.
#pragma once

#include <cstdint>
#include <string>

#include "client/cli/frames/frame_model.h"
#include "client/cli/load/mix.h"
#include "client/cli/load/schedule.h"
#include "client/lib/client.h"
#include "engine/options.h"

namespace warmfront::client::load {

/// Each session has its own thread and connection.
inline constexpr std::uint32_t kMostSessions = 1024;

struct Plan {
  std::string server;
  ClientOptions connection;
  ColliderOptions options;
  SendMode send = SendMode::kAll;
  Mix mix;              ///< what each session asks in turn
  double distance = 0;  ///< of its proximity questions
  std::uint32_t sessions = 1;
  Arrival arrival = Arrival::kClosed;
  double rate = 0;         ///< open loop: frames (of a mix: questions) a second over all sessions
  std::uint64_t seed = 1;  ///< of Poisson gaps
  std::string record_dir;  ///< folder for recordings of all sessions; empty: none
  // Seconds, consecutive, from the time when every session is created and has its first answer.
  double ramp = 0;
  double warmup = 1;
  double duration = 10;

  double measured_from() const { return ramp + warmup; }
  double end() const { return ramp + warmup + duration; }
};

}  // namespace warmfront::client::load
