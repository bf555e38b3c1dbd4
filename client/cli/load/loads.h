// SPDX-License-Identifier: Apache-2.0
// Runs loads one after another, each a point of the report. Used by one thread at a time.
#pragma once

#include <atomic>
#include <span>

#include "client/cli/load/limits.h"
#include "client/cli/load/plan.h"
#include "client/cli/load/playback.h"
#include "client/cli/load/report.h"
#include "engine/result.h"

namespace warmfront::client::load {

class Loads {
 public:
  /// All references must outlive this; `expected` may be null. `interrupted` ends the current load.
  Loads(const Playback& playback, const ExpectedAnswers* expected, const std::atomic<bool>& interrupted,
        Report& report)
      : playback_(playback), expected_(expected), interrupted_(interrupted), report_(report) {}

  /// The point, also added to the report; valid until the next call. Fails as load::run() does.
  Result<const Point*> run(const Plan& plan, std::span<const Limit> limits);

  /// Searches for the highest rate that meets the limit, without errors, and at the requested pace. A rate
  /// that fails is tried a second time, in case the machine was disturbed.
  Status find_knee(Plan plan, const Limit& limit, std::span<const Limit> limits);

 private:
  const Playback& playback_;
  const ExpectedAnswers* const expected_;
  const std::atomic<bool>& interrupted_;
  Report& report_;
};

}  // namespace warmfront::client::load
