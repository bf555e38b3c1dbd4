// SPDX-License-Identifier: Apache-2.0
// One load after another, each a point of the report. Used by one thread at a time.
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
  /// Everything referred to outlives this; `expected` may be null. `interrupted` ends the load under way.
  Loads(const Playback& playback, const ExpectedAnswers* expected, const std::atomic<bool>& interrupted,
        Report& report)
      : playback_(playback), expected_(expected), interrupted_(interrupted), report_(report) {}

  /// The point, which the report has then too, until the next. Fails as load::run() does.
  Result<const Point*> run(const Plan& plan, std::span<const Limit> limits);

  /// Tries rates until the highest is known that keeps the limit, without errors, and at the pace asked for.
  /// A rate that does not is tried once more: machines have other things to do now and then.
  Status find_knee(Plan plan, const Limit& limit, std::span<const Limit> limits);

 private:
  const Playback& playback_;
  const ExpectedAnswers* const expected_;
  const std::atomic<bool>& interrupted_;
  Report& report_;
};

}  // namespace warmfront::client::load
