// SPDX-License-Identifier: Apache-2.0
// How long a session's next step will take one thread, told by what its last one did. Thread-safe.
#pragma once

#include <cstdint>

#include "engine/statistics.h"
#include "server/session/runner.h"

namespace warmfront::server {

/// Milliseconds. By counts, which are the same however busy the machine is: a measured time would call a
/// small step long that had to wait for others, and then keep it where it waits. The weights are those of the
/// README's tables, rounded.
inline double step_cost_ms(std::uint64_t triangles, const StepCounts& last) {
  return 1e-6 * (100.0 * static_cast<double>(triangles) + 20.0 * static_cast<double>(last.bv_tests) +
                 5.0 * static_cast<double>(last.primitive_tests) +
                 300.0 * static_cast<double>(last.elementary_tests));
}

/// Short steps run beside long ones, each on one thread when others are under way.
inline Lane lane_of(double cost_ms) {
  constexpr double kShortMs = 10;
  return cost_ms <= kShortMs ? Lane::kShort : Lane::kLong;
}

}  // namespace warmfront::server
