// SPDX-License-Identifier: Apache-2.0
// One session of a load, and its thread. take_interval() and unserved() may be called from any thread; all
// other functions by one at a time.
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

/// Events since the last call of take_interval().
struct Interval {
  Histogram latency;
  std::uint64_t contacts = 0;
  std::uint64_t errors = 0;

  void merge(const Interval& other);
  /// Forgets all, and keeps the memory.
  void clear();
};

/// That a session's last call did not succeed.
struct Unserved {
  enum class Why { kNoDaemon, kRefused } why = Why::kNoDaemon;
  std::chrono::steady_clock::time_point since;  ///< the first call of those in a row
};

class Lane {
 public:
  using Clock = std::chrono::steady_clock;

  /// All references must outlive the lane; `expected` may be null. `index` < plan.sessions: lanes start at
  /// different frames, so that they are not in phase.
  Lane(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected, std::uint32_t index);

  /// Connects, creates the session and takes its first, cold answer. A failure is counted; run() retries.
  void prepare();
  /// The last failure.
  const std::optional<Error>& failure() const { return failure_; }
  /// False if it could not be created, or was lost and not recovered.
  bool has_session() const { return session_.has_value(); }
  /// Streams from `start` to the plan's end, or until `stop`.
  void run(Clock::time_point start, const std::atomic<bool>& stop);

  Interval take_interval();
  /// Empty while the session is served; set, too, while it looks for a daemon to resume at.
  std::optional<Unserved> unserved() const;
  const Tally& tally() const { return tally_; }

 private:
  /// Purpose of a step.
  enum class Kind { kCold, kUnmeasured, kMeasured };

  double now() const;
  bool wait_until(double due, const std::atomic<bool>& stop) const;
  bool open();
  bool start_recording();
  void count(const Error& error);
  /// Of an answer that did not come.
  void lost(const Error& error);
  void not_served(const Error& error);
  /// Builds the next frame, waits until what the mix asks of it is due, and takes the answer. In a closed
  /// loop it is due at once.
  bool step(std::optional<double> due, Kind kind, const std::atomic<bool>& stop);
  Result<Answer> ask(Asked asked);
  void take(const Answer& answer, const FrameTimes& times, Kind kind, Asked asked);
  void stream(Clock::time_point start, const std::atomic<bool>& stop);
  /// Once.
  void begin_measuring();
  /// Compares with what is expected where the session is, at `tick_`.
  void check(const Answer& answer, Asked asked);

  // Constant after construction.
  const Plan& plan_;
  const Playback& playback_;
  const ExpectedAnswers* const expected_;
  const std::uint32_t index_;

  std::uint64_t tick_;  // where the session is
  Clock::time_point start_ = Clock::now();
  std::optional<Client> client_;
  std::optional<Session> session_;
  std::optional<FrameModel> model_;
  Frame next_;                  // to tick_ + 1, ...
  std::uint64_t next_for_ = 0;  // ... if this is that; 0: it was not built
  Asked taken_ = Asked::kTrial;  // what the next commit takes
  std::size_t asked_ = 0;       // questions since the session was created, or since one failed
  std::uint64_t resumes_ = 0;   // of session_, already counted
  std::optional<Recorder> recorder_;
  std::uint64_t frame_ = 0;  // of session_, last answered
  double free_ = 0;          // time since which no frame is unanswered
  std::optional<Error> failure_;
  Tally tally_;
  bool measuring_ = false;  // of what is measured, tally_ holds no other frames

  mutable std::mutex mutex_;
  // Protected by mutex_.
  Interval interval_;
  std::optional<Unserved> unserved_;
};

}  // namespace warmfront::client::load
