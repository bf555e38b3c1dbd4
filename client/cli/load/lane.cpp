// SPDX-License-Identifier: Apache-2.0
// Streaming one session. Thread safety as stated in the header.
#include "client/cli/load/lane.h"

#include <algorithm>
#include <thread>
#include <utility>

namespace warmfront::client::load {
namespace {

/// Delay before creating a session again, and after a refused frame.
constexpr double kBackoffSeconds = 0.2;
/// How long to wait for a daemon that went away: longer than a restart takes, and short compared with a
/// measurement.
constexpr std::chrono::seconds kResumeTimeout{10};
/// Longest delay before a lane notices an interrupt.
constexpr std::chrono::milliseconds kGlance{50};

bool may_go_on(const Error& error) {
  return error.code == ErrorCode::kResourceExhausted || error.code == ErrorCode::kInvalidArgument;
}

}  // namespace

void Interval::merge(const Interval& other) {
  latency.merge(other.latency);
  contacts += other.contacts;
  errors += other.errors;
}

void Interval::clear() {
  latency.clear();
  contacts = errors = 0;
}

Lane::Lane(const Plan& plan, const Playback& playback, const ExpectedAnswers* expected, std::uint32_t index)
    : plan_(plan),
      playback_(playback),
      expected_(expected),
      index_(index),
      tick_(playback.period() * index / plan.sessions) {}

double Lane::now() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

bool Lane::wait_until(double due, const std::atomic<bool>& stop) const {
  const auto at = start_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(due));
  while (!stop && Clock::now() < at) std::this_thread::sleep_until(std::min(at, Clock::now() + kGlance));
  return !stop;
}

Interval Lane::take_interval() {
  const std::lock_guard lock(mutex_);
  Interval taken = interval_;
  interval_.clear();
  return taken;
}

std::optional<Unserved> Lane::unserved() const {
  const std::lock_guard lock(mutex_);
  return unserved_;
}

void Lane::count(const Error& error) {
  tally_.error(error);
  const std::lock_guard lock(mutex_);
  ++interval_.errors;
}

void Lane::lost(const Error& error) {
  count(error);
  not_served(error);
}

void Lane::not_served(const Error& error) {
  const bool gone = error.code == ErrorCode::kUnavailable || error.code == ErrorCode::kDeadlineExceeded;
  const std::lock_guard lock(mutex_);
  if (!unserved_) unserved_.emplace().since = Clock::now();
  unserved_->why = gone ? Unserved::Why::kNoDaemon : Unserved::Why::kRefused;
}

bool Lane::open() {
  if (!client_) {
    ClientOptions connection = plan_.connection;
    connection.resume_timeout = kResumeTimeout;
    connection.on_lost = [this](const Error& why) { not_served(why); };
    Result<Client> client = Client::connect(plan_.server, connection);
    if (!client) {
      failure_ = client.error();
      lost(client.error());
      return false;
    }
    client_.emplace(std::move(client).value());
  } else if (const Result<client::ServerInfo> there = client_->server_info(); !there) {
    // Creating waits much longer than this for a daemon that does not come back.
    failure_ = there.error();
    lost(there.error());
    return false;
  }
  const Clock::time_point began = Clock::now();
  Result<Session> session = client_->create_session(playback_.scene(), playback_.at(tick_), plan_.options);
  if (!session) {
    failure_ = session.error();
    lost(session.error());
    return false;
  }
  tally_.create.record(std::chrono::duration<double, std::milli>(Clock::now() - began).count());
  ++tally_.sessions_created;
  session_.emplace(std::move(session).value());
  resumes_ = 0;
  model_.reset();
  next_for_ = asked_ = 0;
  frame_ = 0;
  if (!start_recording()) return false;
  if (plan_.send != SendMode::kAll) model_.emplace(playback_.scene(), plan_.send, playback_.at(tick_));
  const std::atomic<bool> never{false};
  return step(std::nullopt, Kind::kCold, never);
}

bool Lane::start_recording() {
  recorder_.reset();
  if (plan_.record_dir.empty()) return true;
  Result<Recorder> recorder = Recorder::create(plan_.record_dir + "/" + session_->id() + ".wfrec",
                                               playback_.scene(), playback_.at(tick_), plan_.options);
  if (!recorder) {
    failure_ = recorder.error();
    count(recorder.error());
    session_.reset();
    return false;
  }
  recorder_.emplace(std::move(recorder).value());
  return true;
}

void Lane::prepare() {
  open();
}

bool Lane::step(std::optional<double> due, Kind kind, const std::atomic<bool>& stop) {
  const Asked asked = kind == Kind::kCold ? Asked::kStep : plan_.mix.at(asked_);
  // One frame for all questions of a motion: what moved is told from where the session is.
  if (std::exchange(next_for_, tick_ + 1) != tick_ + 1) {
    const Positions end = playback_.at(tick_ + 1);
    next_ = model_ ? model_->next(end) : Frame(end);
  }
  if (due && !wait_until(*due, stop)) return false;
  if (recorder_) recorder_->frame(frame_ + 1, next_);
  FrameTimes times;
  times.sent = now();
  times.due = due.value_or(times.sent);
  times.own_late_ms = 1e3 * (times.sent - std::max(due.value_or(0), free_));
  const Result<Answer> answer = ask(asked);
  times.answered = free_ = now();
  tally_.reconnects += session_->resumes() - std::exchange(resumes_, session_->resumes());
  if (!answer) {
    failure_ = answer.error();
    lost(answer.error());
    if (recorder_) recorder_->refusal(frame_ + 1, answer.error());
    asked_ = 0;  // a cycle does not begin with a commit, for which there may be no trial now
    // Only the daemon knows the effect of a partial frame: only whole frames can be sent again.
    if (!may_go_on(answer.error()) || model_) session_.reset();
    return false;
  }
  take(answer.value(), times, kind, asked);
  if (kind != Kind::kCold) ++asked_;
  if (!moves(asked)) return true;
  ++tick_;
  frame_ = answer.value().frame;
  return true;
}

Result<Answer> Lane::ask(Asked asked) {
  const auto answered = [this](const Result<std::uint64_t>& sent) {
    return sent ? session_->next_answer() : Result<Answer>(sent.error());
  };
  switch (asked) {
    case Asked::kStep:
      break;
    case Asked::kTrial:
      return session_->trial(next_);
    case Asked::kCommit:
      return answered(session_->submit_commit());
    case Asked::kMaxStep:
      return answered(session_->submit(next_, {.kind = QuestionKind::kMaxStep}));
    case Asked::kProximity:
      return session_->proximity(plan_.distance);
    case Asked::kIntersections:
      return session_->intersections();
  }
  return session_->step(next_);
}

void Lane::check(const Answer& answer, Asked asked) {
  if (asked == Asked::kTrial || asked == Asked::kMaxStep) taken_ = asked;
  const AnswerDigest& expected = expected_->of(asked == Asked::kCommit ? taken_ : asked, tick_);
  const bool whole = asked != Asked::kCommit && asked != Asked::kMaxStep;
  // Candidates begin earlier than anything touches.
  if (!whole && plan_.options.report == Report::kCandidates) return;
  ++tally_.checked;
  AnswerDigest digest = expected;
  if (whole)
    digest = digest_of(answer);
  else
    digest.earliest_toi = answer.commit ? answer.commit->earliest_toi : answer.earliest_toi;
  if (digest == expected || ++tally_.different > 1) return;
  tally_.first_difference = "session " + session_->id() + ", " +
                            kAskedNames[static_cast<std::size_t>(asked)] + " of frame " +
                            std::to_string(answer.frame) + ": the daemon answered " + describe(digest) +
                            "; the engine in this process " + describe(expected);
}

void Lane::take(const Answer& answer, const FrameTimes& times, Kind kind, Asked asked) {
  const std::uint64_t contacts = answer.total();
  const FrontState front = answer.statistics.front_state;
  ++tally_.all_frames;
  tally_.all_contacts += contacts;
  if (kind == Kind::kCold) tally_.cold.record(1e3 * (times.answered - times.sent));
  if (kind == Kind::kMeasured) begin_measuring();
  if (kind == Kind::kMeasured || !measuring_) tally_.measured(times, answer, asked);
  if (front == FrontState::kRebuilt || (front == FrontState::kBuilt && kind != Kind::kCold))
    ++tally_.rebuilds;
  if (front == FrontState::kCapped) ++tally_.capped;
  if (recorder_) recorder_->answer(answer.frame, digest_of(answer));
  if (expected_ != nullptr) check(answer, asked);
  const std::lock_guard lock(mutex_);
  interval_.latency.record(1e3 * (times.answered - times.due));
  interval_.contacts += contacts;
  unserved_.reset();
}

void Lane::begin_measuring() {
  if (!std::exchange(measuring_, true)) tally_.begin_measuring();
}

void Lane::run(Clock::time_point start, const std::atomic<bool>& stop) {
  stream(start, stop);
  begin_measuring();  // of a run that ended before it was to
}

void Lane::stream(Clock::time_point start, const std::atomic<bool>& stop) {
  start_ = start;
  const double share = static_cast<double>(index_) / plan_.sessions;
  const bool open_loop = plan_.arrival != Arrival::kClosed;
  Schedule schedule(plan_.arrival, open_loop ? plan_.rate / plan_.sessions : 1, plan_.ramp, share,
                    plan_.seed + index_);
  free_ = 0;
  if (!open_loop && !wait_until(share * plan_.ramp, stop)) return;
  while (!stop) {
    std::optional<double> due;
    if (open_loop) due = schedule.next();
    const double at = due.value_or(now());
    if (at >= plan_.end()) return;
    if (now() >= plan_.end()) {
      ++tally_.unsent;
      continue;
    }
    const Kind kind = at < plan_.measured_from() ? Kind::kUnmeasured : Kind::kMeasured;
    if (!session_) {
      // The due frame stays due until a session is created.
      while (!stop && now() < plan_.end() && !open()) wait_until(now() + kBackoffSeconds, stop);
      if (!session_) {
        if (open_loop && !stop) ++tally_.unsent;
        continue;
      }
      free_ = now();
    }
    if (!step(due, kind, stop) && session_) wait_until(now() + kBackoffSeconds, stop);
  }
}

}  // namespace warmfront::client::load
