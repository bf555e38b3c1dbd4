// SPDX-License-Identifier: Apache-2.0
// What is done with a step that will take one thread so long (step_cost_ms()). Thread-safe.
#pragma once

#include "engine/statistics.h"
#include "server/session/runner.h"

namespace warmfront::server {

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

}  // namespace warmfront::server
