// SPDX-License-Identifier: Apache-2.0
// A session in this process: a collider, and a thread for what is asked of it without waiting. Used by one
// thread at a time.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/lib/answer.h"
#include "client/lib/pending.h"
#include "engine/collider.h"

namespace warmfront::client {

class LocalSession : public std::enable_shared_from_this<LocalSession> {
 public:
  /// What is asked: a question of a frame, or a commit.
  struct Request {
    Frame frame = {};
    Question question = {};
    std::optional<double> commit = std::nullopt;
    /// As Collider's, for questions: a last word before the session moves. On the thread that computes.
    AcceptStep accept = {};

    bool counts() const { return commit || question.counts(); }
    /// Has it a motion, which takes the place of the last trial?
    bool moves() const { return !commit && !question.of_state(); }
    bool needs_trial() const { return commit || (question.of_state() && question.where == Where::kTrialEnd); }
  };

  /// `rounding`: of commits. `first_frame`: the number of where the collider is.
  LocalSession(Collider collider, Rounding rounding, std::uint64_t first_frame = 0)
      : collider_(std::move(collider)), rounding_(rounding), next_(first_frame + 1), frame_(first_frame) {}
  /// Stops what is computed. What is not answered never is.
  ~LocalSession();

  /// As Questions::ask(). What nobody else can ask meanwhile is computed at once, on this thread.
  std::shared_ptr<PendingAnswer> ask(const Request& request, const WaitOptions& wait, bool handed_out);
  bool float32() const { return rounding_ == Rounding::kFloat32; }
  /// kInvalidArgument, in words that begin with `where`, for positions of another type than the session's.
  Status check_kind(const Positions& positions, const std::string& where) const;
  /// kFailedPrecondition while answers are awaited. If not, collider() is the caller's.
  Status check_idle() const;
  Collider& collider() { return collider_; }
  /// The last one; not while answers are awaited.
  std::uint64_t frame() const { return frame_; }

 private:
  class Job;

  /// Waits until the job is settled, or until then: is it? Stops the one that is computed where it is given
  /// up.
  bool wait(const Job& job, PendingAnswer::Time until);
  /// The thread.
  void compute_all();
  /// An answer that counts is still to be counted.
  Result<Answer> compute(const Request& request, const std::atomic<bool>* stop);
  /// The frame as a daemon is sent it: in a session of float32 poses are rounded to that.
  Frame as_sent(const Frame& frame);
  /// As a daemon looks at a question before it carries it out.
  Status check(const Request& request) const;
  Status check_kind(const Frame& frame) const;

  // Used by whoever computes: the thread while jobs_ are there, else who uses the session.
  Collider collider_;
  const Rounding rounding_;
  std::vector<BodyPose> rounded_;
  bool trial_lost_ = false;  // a motion was not computed, and the collider's trial is not the last one

  // The frame that comes next, as far as the caller can know: a step that fails is known of when it was
  // waited for. Whether a later one fails with it depends on that alone, and not on which thread was faster.
  std::uint64_t next_;
  std::uint64_t failures_ = 0;  // that are known so

  // Changed with the lock held while jobs_ are there.
  std::uint64_t frame_;  // the last

  // Protected by mutex_.
  mutable std::mutex mutex_;
  std::condition_variable changed_;        // a job is there, or is settled, or the end has come
  std::deque<std::shared_ptr<Job>> jobs_;  // the first one is being computed
  bool ending_ = false;

  std::thread thread_;  // from the first job on
};

}  // namespace warmfront::client
