// SPDX-License-Identifier: Apache-2.0
// A place of a script at which failures are met: the states before and after it are known, and how a collider
// goes on from both.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tests/faults/fault_scripts.h"
#include "tests/faults/now_trying.h"
#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"
#include "tests/support/failing_allocations.h"

namespace warmfront::testing {

inline constexpr int kStepsAfter = 10;

inline const std::shared_ptr<Workers>& one_thread() {
  static const auto workers = std::make_shared<Workers>(1);
  return workers;
}

// A step and its correct outcome.
struct Step {
  AcceptedState before;
  Operation operation;
  Outcome expected;
  AcceptedState after;
};

// The options in force after the operation.
inline ColliderOptions options_after(const Operation& operation, const ColliderOptions& before) {
  const auto* changes = std::get_if<ChangesOperation>(&operation);
  return changes != nullptr && changes->options ? *changes->options : before;
}

inline std::vector<Step> draw_steps(std::uint64_t seed, const AcceptedState& from,
                                    const ColliderOptions& options) {
  Draws draws(seed);
  std::vector<Step> steps;
  AcceptedState state = from;
  for (int i = 0; i < kStepsAfter; ++i) {
    Step step{state, draw_step(draws, state), {}, {}};
    step.expected = state.brute_force(std::get<StepOperation>(step.operation), options);
    state.accept(step.operation);
    step.after = state;
    steps.push_back(std::move(step));
  }
  return steps;
}

// Operation `at` of a script, with the correct states before and after it.
class Place {
 public:
  Place(const Script& script, std::size_t at, std::shared_ptr<Workers> workers = one_thread())
      : script_(script),
        at_(at),
        workers_(std::move(workers)),
        before_(script.start),
        options_(script.options) {
    for (std::size_t i = 0; i < at; ++i) {
      before_.accept(script.operations[i]);
      options_ = options_after(script.operations[i], options_);
    }
    after_ = before_;
    after_.accept(operation());
    steps_before_ = draw_steps(2 * at, before_, options_);
    steps_after_ = draw_steps(2 * at + 1, after_, options_after(operation(), options_));
  }

  const Operation& operation() const { return script_.operations[at_]; }
  std::string name() const {
    return script_.name + ", operation " + std::to_string(at_) + ", " + to_string(operation());
  }

  /// Colliders without failures, one that ran the script and one without history, continue as brute force
  /// says.
  void learn() {
    Collider control = arrive();
    expect_as_before(control);
    go_on(control, steps_before_, "control");
    Collider fresh = before_.fresh(options_, workers_);
    go_on(fresh, steps_before_, "fresh");
    Collider through = arrive();
    expected_ = carry_out(through, operation());
    ASSERT_TRUE(expected_.done()) << to_string(expected_);
    expect_done(through, expected_);
  }

  /// A collider just before the operation.
  Collider arrive() const {
    Collider collider = script_.start.fresh(script_.options, workers_);
    for (std::size_t i = 0; i < at_; ++i) {
      const Outcome outcome = carry_out(collider, script_.operations[i]);
      if (!outcome.done())
        throw std::logic_error(to_string(script_.operations[i]) + ": " + to_string(outcome));
    }
    return collider;
  }

  /// Injects the fault into the operation. False: it did not occur, so no later place need be tried. A collider goes on in
  /// one way only, so of any two neighbouring places (bits of n summed, Thue and Morse: no period of allocations is met in
  /// one way alone) one goes on from the state before, and one does the operation again.
  bool meet(const Fault& fault) const {
    now_trying = name() + ", " + to_string(fault);
    Collider collider = arrive();
    const Outcome outcome = carry_out(collider, operation(), fault);
    if (outcome.done()) {
      expect_done(collider, outcome);
      return outcome.met_fault;
    }
    expect_failed(outcome, fault);
    expect_as_before(collider);
    if (std::popcount(static_cast<unsigned long>(fault.n)) % 2 == 0) {
      go_on(collider, steps_before_, "after the failure");
    } else {
      // With several threads there may be no such place the next time: then it is done.
      const Outcome once_more = carry_out(collider, operation(), fault);
      expect_done(collider, once_more.done() ? once_more : carry_out(collider, operation()));
    }
    return true;
  }

  /// One collider meets one fault after another, repeatedly, and then continues.
  void meet_all(Fault fault, long most) const {
    Collider collider = arrive();
    // Caches for the next call may remain; a leak grows with every failure.
    bool grows = true;
    for (int round = 0; grows && round < 12; ++round) {
      const std::size_t held = live_bytes();
      for (fault.n = 0; fault.n < most; ++fault.n) {
        now_trying = name() + ", one after the other, " + to_string(fault);
        // The call absorbed the failure; meet() has checked that.
        if (carry_out(collider, operation(), fault).done()) return;
      }
      expect_as_before(collider);
      grows = live_bytes() > held;
    }
    EXPECT_FALSE(grows) << "memory is lost with every failure";
    go_on(collider, steps_before_, "after all failures");
  }

 private:
  void expect_done(Collider& collider, const Outcome& outcome) const {
    EXPECT_EQ(difference(outcome, expected_), "") << "the operation itself";
    EXPECT_EQ(after_.difference(collider), "");
    go_on(collider, steps_after_, "after the operation");
  }
  void expect_failed(const Outcome& outcome, const Fault& fault) const {
    const bool right = fault.kind == Fault::Kind::kCancelled ? outcome.refused(ErrorCode::kCancelled)
                                                             : outcome.kind == Outcome::Kind::kOutOfMemory;
    EXPECT_TRUE(right) << to_string(outcome);
  }
  void expect_as_before(Collider& collider) const {
    EXPECT_EQ(before_.difference(collider), "");
    EXPECT_TRUE(collider.options() == options_);
    const Status sound = collider.self_check();
    EXPECT_TRUE(sound.ok()) << sound.error().message;
  }
  static void go_on(Collider& collider, std::span<const Step> steps, const char* when) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      std::string differs = difference(carry_out(collider, steps[i].operation), steps[i].expected);
      if (differs.empty()) differs = steps[i].after.difference(collider);
      EXPECT_EQ(differs, "") << when << ", step " << i
                             << " of those that follow: " << to_string(steps[i].operation);
      if (!differs.empty()) return;
    }
  }

  const Script& script_;
  const std::size_t at_;
  const std::shared_ptr<Workers> workers_;
  AcceptedState before_, after_;
  ColliderOptions options_;  // before it
  std::vector<Step> steps_before_, steps_after_;
  Outcome expected_;
};

}  // namespace warmfront::testing
