// SPDX-License-Identifier: Apache-2.0
// Carries out a plan. Called by one thread at a time.
#pragma once

#include <atomic>
#include <functional>

#include "client/cli/load/measured.h"
#include "client/cli/load/plan.h"
#include "client/cli/load/playback.h"

namespace warmfront::client::load {

/// Runs the plan; calls `each_second`, with the latencies of that second, on this thread. `stop` ends it
/// early. Fails when no session could be created.
Result<Measured> run(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected,
                     const std::function<void(const Second&, const Histogram& latency)>& each_second,
                     const std::atomic<bool>& stop);

}  // namespace warmfront::client::load
