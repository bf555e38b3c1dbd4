// SPDX-License-Identifier: Apache-2.0
// What a frame's outcome adds to its trace. A pure function.
#pragma once

#include <cstdint>

#include "proto/wire/codes.h"
#include "server/observe/frame_trace.h"
#include "server/session/admitted_frame.h"

namespace warmfront::server {

inline void note_outcome(const FrameOutcome& outcome, FrameTrace& trace) {
  trace.computed = FrameTrace::Clock::now();
  if (!outcome) {
    trace.code = wire::canonical_code(outcome.fault().code);
    trace.set_message(outcome.fault().message);
    return;
  }
  trace.stages_ms = outcome.value()->statistics.ms;
  trace.rows = outcome.value()->rows();
}

}  // namespace warmfront::server
