// SPDX-License-Identifier: Apache-2.0
// A session of a daemon and the model of its accepted operations: each answer is compared with brute force.
// Used by one thread at a time.
#pragma once

#include <functional>
#include <string>

#include "tests/faults/session_driver.h"

namespace warmfront::test {

/// Runs a call, possibly with an injected fault.
using Around = std::function<void(const std::function<void()>& call)>;
inline void as_it_is(const std::function<void()>& call) {
  call();
}

/// Functions return a description of the error; empty if there is none.
class RemoteSession {
 public:
  /// A daemon may refuse answers of more contacts than `few`, and never one of fewer.
  RemoteSession(SessionDriver& driver, testing::AcceptedState state, const ColliderOptions& options,
                std::size_t few = ColliderOptions{}.max_contacts);

  /// To be called first.
  std::string create();
  std::string step(const testing::StepOperation& operation, const Around& around = as_it_is);
  /// The second is sent before the answer to the first is taken; both are valid where the other is accepted.
  std::string two_steps(const testing::StepOperation& first, const testing::StepOperation& second,
                        const std::function<void()>& between);
  /// Of the last trial, where there is one; else it must be refused.
  std::string commit(double fraction, const Around& around = as_it_is);
  /// All are sent before the answer to the first is taken: a trial, a commit of it, and a step that is valid
  /// where that is accepted.
  std::string trial_commit_step(const testing::StepOperation& trial, double fraction,
                                const testing::StepOperation& step, const std::function<void()>& between);
  /// Of the last trial's end it must be refused where there is none.
  std::string near(const testing::NearOperation& operation, const Around& around = as_it_is);
  std::string add(const testing::AddOperation& add, const Around& around = as_it_is);
  std::string change(const testing::ChangeOperation& change, const Around& around = as_it_is);
  std::string change_filters(const PairFilters& filters, const Around& around = as_it_is);
  std::string change_excluded_pairs(const ChangeExcludedPairs& other, const Around& around = as_it_is);
  std::string change_options(const ColliderOptions& options, const Around& around = as_it_is);
  /// Elements or a body that is replaced.
  std::string replace(const SceneChange& change, const Around& around = as_it_is);
  /// Of which the daemon, or the client itself, must say kInvalidArgument.
  std::string wrong_step(const testing::StepOperation& operation);
  std::string wrong_change();
  std::string wrong_filters();
  std::string wrong_replacement();
  std::string wrong_options();
  /// Is everything where the client says?
  std::string check_state() const;
  std::string close();

  const testing::AcceptedState& state() const { return state_; }
  /// What is drawn for it from now on is of this size, and near here on each axis.
  void draw_near(double unit, double offset) {
    state_.unit = unit;
    state_.offset = offset;
  }
  const ColliderOptions& options() const { return options_; }
  Rounding rounding() const { return driver_.single() ? Rounding::kFloat32 : Rounding::kFloat64; }

 private:
  std::string check(const testing::StepOperation& operation, const Result<client::Answer>& answer,
                    bool& accepted);

  std::string check_commit(double fraction, const Result<CommitResult>& commit);

  SessionDriver& driver_;
  testing::AcceptedState state_;
  ColliderOptions options_;
  const std::size_t few_;
};

}  // namespace warmfront::test
