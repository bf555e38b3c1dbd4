// SPDX-License-Identifier: Apache-2.0
// Replays a recording and compares. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/cli/recording/recorded_session.h"
#include "client/cli/recording/replay_target.h"

namespace warmfront::client {

struct ReplayResult {
  std::uint64_t steps = 0;       ///< carried out: all that is asked of a frame but
  std::uint64_t placements = 0;  ///< where everything is put without a motion
  std::uint64_t compared =
      0;  ///< answers, refusals and repeats among the recorded ones that could be compared
  std::uint64_t left_out = 0;  ///< frames and changes that were refused for what the input does not tell
  std::uint64_t changes = 0;
  std::string difference;  ///< the first, which ends the replay; empty if there is none
  std::string defect;      ///< of the recording
};

/// Steps `target` through all recorded frames that counted. Fails for a malformed recording, and when the
/// target fails otherwise than by refusing a frame.
Result<ReplayResult> replay(RecordedSession& recorded, ReplayTarget& target,
                            const std::function<void(std::uint64_t steps)>& progress);

}  // namespace warmfront::client
