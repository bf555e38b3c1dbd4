// SPDX-License-Identifier: Apache-2.0
// The wall-clock time of a step, by stage. Used by one thread at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <numeric>
#include <utility>

#include "engine/parallel/stage_clock.h"
#include "engine/statistics.h"

namespace warmfront {

/// Every moment of a step counts for one stage, so that the stages add up to the total.
class StepTimer {
 public:
  explicit StepTimer(StageTimes& ms) : ms_(ms) {}

  /// The time since the last call was spent in this stage.
  void add(double StageTimes::*stage) {
    const double ms = lap();
    ms_.*stage += ms;
    ms_.total += ms;
  }

  /// The time since the last call was spent in stages that share their loops: it is divided in proportion to
  /// the threads' time in each. Where no thread was timed, all of it counts for `otherwise`.
  void share(const StageSeconds& threads, double StageTimes::*otherwise) {
    const double all = std::accumulate(threads.begin(), threads.end(), 0.0);
    if (!(all > 0)) return add(otherwise);
    const double ms = lap();
    const auto part = [&](Stage stage) { return ms * threads[static_cast<std::size_t>(stage)] / all; };
    ms_.refit += part(Stage::kRefit);
    ms_.front += part(Stage::kFront);
    ms_.elementary += part(Stage::kElementary);
    ms_.total += ms;
  }

 private:
  // Milliseconds since the last call.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double, std::milli>(now - std::exchange(last_, now)).count();
  }

  StageTimes& ms_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace warmfront
