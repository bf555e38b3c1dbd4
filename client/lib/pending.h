// SPDX-License-Identifier: Apache-2.0
// Questions whose answers are awaited, with cancellation and time limits. Used by the thread that uses their
// session; cancel() is for any thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <utility>

#include "client/lib/answer.h"
#include "engine/result.h"

namespace warmfront::client {

/// How long an answer is waited for. A question that is given up does not count: the session is where it was,
/// and is used as before; but where it was a motion whose turn had come, no trial before it can be committed.
/// An answer that is there already is taken.
struct WaitOptions {
  /// As Collider's: gives the question up when it is true, kCancelled. Any thread may set it. It must outlive
  /// the question. Null: never.
  const std::atomic<bool>* cancelled = nullptr;
  /// Gives the question up after this time of waiting for it, all questions before it being answered:
  /// kDeadlineExceeded. kInvalidArgument unless it is positive. None: as long as the session waits.
  std::optional<std::chrono::milliseconds> timeout = std::nullopt;
};

/// A question on its way, as its session and its Pending share it. Internal to the client library.
class PendingAnswer {
 public:
  using Clock = std::chrono::steady_clock;
  using Time = Clock::time_point;

  /// Any time of waiting, however long.
  static Time after(Time now, std::chrono::milliseconds time) {
    return now + std::min(time, std::chrono::duration_cast<std::chrono::milliseconds>(Time::max() - now));
  }
  /// Before a question is asked: kInvalidArgument for a timeout that is not positive, kCancelled where it is
  /// cancelled already.
  static Status check(const WaitOptions& wait);
  static Error cancelled();

  /// `handed_out`: somebody may call cancel().
  PendingAnswer(const WaitOptions& wait, bool handed_out) : wait_(wait), handed_out_(handed_out) {}
  /// One that has its answer.
  explicit PendingAnswer(Result<Answer> answer) : PendingAnswer({}, false) { settle(std::move(answer)); }
  virtual ~PendingAnswer() = default;
  PendingAnswer(const PendingAnswer&) = delete;
  PendingAnswer& operator=(const PendingAnswer&) = delete;

  /// Waits for it, until then at the latest. Is it settled?
  virtual bool wait_until(Time until);
  /// Waits, and takes the answer, or throws what was thrown. kFailedPrecondition where it was taken before.
  Result<Answer> take();
  void cancel() { stop_.store(true, std::memory_order_relaxed); }

  // For its session, which sees to it that one thread at a time does this.
  bool settled() const { return answer_ || thrown_; }
  bool failed() const { return thrown_ || (answer_ && !*answer_); }
  void settle(Result<Answer> answer) { answer_ = std::move(answer); }
  void settle(std::exception_ptr thrown) { thrown_ = std::move(thrown); }
  /// Why it is to be given up, if it is. The first look begins its timeout, if its turn has come.
  std::optional<Error> given_up(Time now, bool in_turn = true);
  /// When to ask given_up() again.
  Time next_look(Time now) const;
  /// True once it is cancelled: for Collider.
  const std::atomic<bool>* stop() const { return &stop_; }

 private:
  const WaitOptions wait_;
  const bool handed_out_;
  std::atomic<bool> stop_{false};  // any thread
  std::optional<Time> time_up_;    // from its turn on
  std::optional<Result<Answer>> answer_;
  std::exception_ptr thrown_;
  bool taken_ = false;
};

/// The answer, a T, to a question that was asked without waiting. Questions are answered in the order in
/// which they were asked, each in its turn, also where it was cancelled. It is as std::future: get() once.
/// But the answers of a daemon are taken, and time limits and cancellation take effect, while some call of
/// the session or a Pending of it waits. Without its Pending a question is still asked, and a step or commit
/// counts.
template <class T>
class [[nodiscard]] Pending {
 public:
  /// Internal: use a session's functions.
  Pending(std::shared_ptr<PendingAnswer> answer, T (*convert)(Answer))
      : answer_(std::move(answer)), convert_(convert) {}

  /// Waits for the answer and takes it, with the errors that the waiting call has. kCancelled after cancel(),
  /// unless the answer was there before; kFailedPrecondition where the session ended first, or the answer was
  /// taken before.
  Result<T> get() {
    Result<Answer> answer = answer_->take();
    if (!answer) return answer.error();
    return convert_(std::move(answer).value());
  }
  /// Waits for at most this time. Would get() return at once?
  bool wait_for(std::chrono::milliseconds time) {
    return answer_->wait_until(PendingAnswer::after(PendingAnswer::Clock::now(), time));
  }
  /// Gives the question up in its turn: it does not count, as WaitOptions say. Any thread.
  void cancel() { answer_->cancel(); }

 private:
  std::shared_ptr<PendingAnswer> answer_;
  T (*convert_)(Answer);
};

}  // namespace warmfront::client
