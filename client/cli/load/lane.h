// SPDX-License-Identifier: Apache-2.0
// One session of a load, and the thread that it lives on. take_interval() may be called from any thread; all
// else by one at a time.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

#include "client/cli/load/plan.h"
#include "client/cli/load/playback.h"
#include "client/cli/load/tally.h"
#include "client/cli/recording/recorder.h"

namespace warmfront::client::load {

/// What happened since it was last asked for.
struct Interval {
  Histogram latency;
  std::uint64_t contacts = 0;
  std::uint64_t errors = 0;

  void merge(const Interval& other);
};

class Lane {
 public:
  using Clock = std::chrono::steady_clock;

  /// Everything referred to outlives the lane; `expected` may be null. `index` of plan.sessions: lanes start
  /// at different frames, so that they are not in step with each other.
  Lane(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected, std::uint32_t index);

  /// Connects, creates the session and takes its first, cold answer. A failure is counted, and tried again by
  /// run().
  void prepare();
  /// What failed last.
  const std::optional<Error>& failure() const { return failure_; }
  /// False when it could not be had, or was lost and not had again.
  bool has_session() const { return session_.has_value(); }
  /// Streams from `start` to the plan's end, or until `stop`.
  void run(Clock::time_point start, const std::atomic<bool>& stop);

  Interval take_interval();
  const Tally& tally() const { return tally_; }

 private:
  /// What a step is for.
  enum class Kind { kCold, kUnmeasured, kMeasured };

  double now() const;
  bool wait_until(double due, const std::atomic<bool>& stop) const;
  bool open();
  bool start_recording();
  void lost(const Error& error);
  /// Builds the next frame, waits until it is due, and takes its answer. A closed loop's are due at once.
  bool step(std::optional<double> due, Kind kind, const std::atomic<bool>& stop);
  void take(const Answer& answer, const FrameTimes& times, Kind kind);

  // Constant after construction.
  const Plan& plan_;
  const Playback& playback_;
  const ExpectedAnswers* const expected_;
  const std::uint32_t index_;

  std::uint64_t tick_;  // that was answered last
  Clock::time_point start_ = Clock::now();
  std::optional<Client> client_;
  std::optional<Session> session_;
  std::optional<FrameModel> model_;
  std::uint64_t resumes_ = 0;  // of session_, counted already
  std::optional<Recorder> recorder_;
  std::uint64_t frame_ = 0;  // of session_, that was answered last
  double free_ = 0;          // since when nothing is unanswered
  std::optional<Error> failure_;
  Tally tally_;

  std::mutex mutex_;
  Interval interval_;  // protected by mutex_
};

}  // namespace warmfront::client::load
