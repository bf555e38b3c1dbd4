// SPDX-License-Identifier: Apache-2.0
// How long a session's next step will take one thread, told by what its last one did. Thread-safe.
#pragma once

#include <cstdint>

#include "engine/statistics.h"
#include "server/session/runner.h"

namespace warmfront::server {

/// Milliseconds of one thread, if the whole scene moves. By counts, which are the same however busy the
/// machine is: a measured time would call a small step long that had to wait for others, and then keep it
/// where it waits. The weights are fitted to the sequences of tests/README.md, whose steps they meet within a
/// third; what the smallest step takes is mostly its answer's way out.
inline double step_cost_ms(std::uint64_t triangles, const StepCounts& last) {
  return 1e-6 * (50'000.0 + 60.0 * static_cast<double>(triangles) +
                 20.0 * static_cast<double>(last.bv_tests) + 3.0 * static_cast<double>(last.primitive_tests) +
                 200.0 * static_cast<double>(last.elementary_tests));
}

/// Short steps run beside long ones, each on one thread when others are under way.
inline Lane lane_of(double cost_ms) {
  constexpr double kShortMs = 10;
  return cost_ms <= kShortMs ? Lane::kShort : Lane::kLong;
}

/// A brief step stays on the thread that received it: to wake another costs 0.03 to 0.1 ms. And steps of one
/// session that are brief together are taken together: to come back to a session after others costs as much.
inline bool is_brief(double cost_ms) {
  constexpr double kBriefMs = 2;
  return cost_ms <= kBriefMs;
}

/// A small step runs on one thread, also beside nothing: to wake another, which looks for work for a while
/// before it sleeps again, costs two to three times the step, and makes the step itself no shorter.
inline bool is_small(double cost_ms) {
  constexpr double kSmallMs = 0.5;
  return cost_ms <= kSmallMs;
}

}  // namespace warmfront::server
