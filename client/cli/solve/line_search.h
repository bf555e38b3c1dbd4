// SPDX-License-Identifier: Apache-2.0
// What `solve` does in a frame: a line search of trials, and a commit. Used by the main thread only.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "client/cli/solve/report.h"
#include "client/lib/any_session.h"
#include "engine/contact_hash.h"
#include "engine/part_way.h"

namespace warmfront::client {

/// Calls `work`; how long it took is written to `ms`.
template <class Work>
auto timed(double& ms, Work work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  return result;
}

/// A line search a frame: stands at X, asks along X to the frame, and commits the shortest trial.
template <class Number>
class LineSearch {
 public:
  LineSearch(const SolveArguments& arguments, AnySession session, std::optional<AnySession> beside,
             std::span<const Number> start)
      : arguments_(arguments),
        session_(std::move(session)),
        beside_(std::move(beside)),
        at_(start.begin(), start.end()) {}

  Result<SolveFrame> frame(std::uint64_t number, std::span<const Number> there) {
    SolveFrame report{number, {}, 0, {}, 0, {}};
    double length = 1;
    if (arguments_.max_step) {
      const Result<MaxStep> far = timed(report.max_step_ms, [&] {
        return session_.max_step(Frame{there}, true, {.keep_distance = arguments_.keep_distance});
      });
      if (!far) return far.error();
      report.max_step = far.value().fraction;
      if (far.value().fraction < 1) length = arguments_.keep * far.value().fraction;
    }
    for (int trial = 0; trial < arguments_.trials; ++trial, length *= arguments_.shrink) {
      go(there, length);
      TrialReport told{length, 0, 0, {}, 0};
      const Result<Answer> answer =
          timed(told.ms, [&] { return session_.trial(Frame{std::span<const Number>(trial_)}); });
      if (!answer) return answer.error();
      told.vf = answer.value().vf;
      told.ee = answer.value().ee;
      told.earliest_toi = answer.value().earliest_toi;
      add(answer.value().contacts);
      report.trials.push_back(told);
    }
    const Result<CommitResult> committed = timed(report.commit_ms, [&] { return session_.commit(); });
    if (!committed) return committed.error();
    at_.swap(trial_);
    if (beside_) {
      double ms = 0;
      const Result<Answer> step =
          timed(ms, [&] { return beside_->step(Frame{std::span<const Number>(at_)}); });
      if (!step) return step.error();
      report.step_ms = ms;
    }
    return report;
  }

  std::string hash() const { return hash_.hex(); }

 private:
  void go(std::span<const Number> there, double length) {
    constexpr bool kSingle = std::is_same_v<Number, float>;
    trial_.resize(at_.size());
    for (std::size_t i = 0; i < at_.size(); ++i)
      trial_[i] = static_cast<Number>(part_way(at_[i], there[i], length, kSingle));
  }
  void add(const ContactTable& contacts) {
    hash_.begin_step(contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i)
      hash_.add(contacts.kind[i], contacts.status[i], contacts.vertices[i], contacts.toi[i]);
  }

  const SolveArguments& arguments_;
  AnySession session_;
  std::optional<AnySession> beside_;
  std::vector<Number> at_;     // where the session stands
  std::vector<Number> trial_;  // where the last trial went
  ContactHash hash_;
};

}  // namespace warmfront::client
