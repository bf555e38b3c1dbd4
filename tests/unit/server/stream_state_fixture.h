// SPDX-License-Identifier: Apache-2.0
// What the tests of a StreamSteps call's states share.
#pragma once

#include <cstddef>
#include <string>

#include "server/transport/stream_state.h"

namespace warmfront::server::stream_states {

inline constexpr StreamBounds kBounds{2, 100};
/// Of a frame.
inline constexpr std::size_t kBytes = 60;

inline std::string describe(const StreamState& s) {
  return "course " + std::to_string(static_cast<int>(s.course)) + " read " +
         std::to_string(static_cast<int>(s.read)) + " write " + std::to_string(static_cast<int>(s.write)) +
         " attach " + std::to_string(static_cast<int>(s.attach)) + (s.awaiting ? " awaiting" : "") +
         " in flight " + std::to_string(s.in_flight) + " waiting " + std::to_string(s.waiting) + " bytes " +
         std::to_string(s.queued_bytes);
}

}  // namespace warmfront::server::stream_states
