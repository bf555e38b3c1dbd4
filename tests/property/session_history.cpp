// SPDX-License-Identifier: Apache-2.0
// Operations are carried out or refused, and answers and states compared.
#include "tests/property/session_history.h"

#include <rapidcheck/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>
#include <variant>

#include "tests/support/failing_allocations.h"

namespace warmfront::testing {
namespace {

// For a crash: the history so far.
std::string now_trying;  // NOLINT: read by the handler below
[[noreturn]] void tell_and_end() {
  std::fprintf(stderr, "the process ended in: %s\n", now_trying.c_str());
  std::abort();
}
const auto installed = std::set_terminate(tell_and_end);

}  // namespace

History::History(std::uint64_t seed, std::shared_ptr<Workers> workers, Scenes scenes)
    : workers_(std::move(workers)),
      scenes_(scenes),
      draws_(seed),
      state_(scenes == Scenes::kLarge ? draw_any_large_state(draws_) : draw_any_state(draws_)),
      options_(in_tier_of(state_, draw_options(draws_, state_.unit))),
      collider_(std::make_unique<Collider>(state_.fresh(options_, workers_))) {
  now_trying = "a history of seed " + std::to_string(seed) + ":";
}

void History::end() {
  const std::size_t said = collider_->memory_bytes(), with = live_bytes();
  collider_.reset();
  const std::size_t held = with - live_bytes();
  if (said < held)
    RC_FAIL("memory_bytes() is " + std::to_string(said) + ", and the allocator held " + std::to_string(held) +
            " in " + now_trying);
}

// The answer that an operation must get when it meets no fault.
Outcome History::right(const Operation& operation) const {
  if (scenes_ == Scenes::kLarge) return by_a_fresh_one(operation);
  if (const auto* near = std::get_if<NearOperation>(&operation)) return state_.brute_force(*near, options_);
  const auto* step = std::get_if<StepOperation>(&operation);
  return step == nullptr ? Outcome{} : state_.brute_force(*step, options_);
}

Outcome History::by_a_fresh_one(const Operation& operation) const {
  const auto* near = std::get_if<NearOperation>(&operation);
  if (near == nullptr && !std::holds_alternative<StepOperation>(operation)) return {};
  ColliderOptions options = options_;
  options.front = FrontMode::kNone;
  options.find_bodies = options.find_rigid = options.separate_parts = false;
  Collider fresh = state_.fresh(options, workers_);
  if (near != nullptr && near->where == Where::kTrialEnd) carry_out(fresh, *state_.trial);
  return carry_out(fresh, operation);
}

void History::carry(const Operation& operation, const Fault& fault) {
  now_trying += "\n  " + to_string(operation) + ", " + to_string(fault);
  const Outcome outcome = carry_out(*collider_, operation, fault);
  now_trying += ": " + to_string(outcome);
  if (!failed_by(fault, outcome)) {
    const Outcome expected = right(operation);
    if (const std::string differs = difference(outcome, expected); !differs.empty()) fail(operation, differs);
    if (expected.done())
      accept(operation);
    else
      forget_trial(operation);
  } else {
    forget_trial(operation);
  }
  expect_accepted_state(operation);
}

void History::accept(const Operation& operation) {
  state_.accept(operation);
  const auto* changes = std::get_if<ChangesOperation>(&operation);
  if (changes != nullptr && changes->options) options_ = *changes->options;
}

void History::refuse(const Operation& operation, const Fault& fault, ErrorCode code) {
  now_trying += "\n  wrong: " + to_string(operation) + ", " + to_string(fault);
  const Outcome outcome = carry_out(*collider_, operation, fault);
  now_trying += ": " + to_string(outcome);
  if (!failed_by(fault, outcome) && !outcome.refused(code))
    fail(operation, "it is wrong, and came to: " + to_string(outcome));
  if (outcome.kind == Outcome::Kind::kRefused && outcome.error.message.empty())
    fail(operation, "refused without a message");
  forget_trial(operation);
  expect_accepted_state(operation);
}

// Filters may name a vertex that goes, before the error is reached.
void History::refuse_one_of(const ChangesOperation& changes, const Fault& fault) {
  const bool filtered = !state_.scene.filters.excluded_vertex_pairs.empty();
  now_trying += "\n  wrong: " + to_string(Operation(changes)) + ", " + to_string(fault);
  const Outcome outcome = carry_out(*collider_, changes, fault);
  if (!failed_by(fault, outcome) && !outcome.refused(ErrorCode::kInvalidArgument) &&
      !(filtered && outcome.refused(ErrorCode::kFailedPrecondition)))
    fail(changes, "it is wrong, and came to: " + to_string(outcome));
  forget_trial(changes);
  expect_accepted_state(changes);
}

// A question that failed is followed by no commit; nor are changes.
void History::forget_trial(const Operation& failed) {
  const bool keeps =
      std::holds_alternative<CheckOperation>(failed) || std::holds_alternative<ForgetOperation>(failed) ||
      std::holds_alternative<NearOperation>(failed) || std::holds_alternative<CommitOperation>(failed);
  if (!keeps) state_.trial.reset();
}

bool History::failed_by(const Fault& fault, const Outcome& outcome) {
  if (!outcome.met_fault) return false;
  return fault.kind == Fault::Kind::kCancelled ? outcome.refused(ErrorCode::kCancelled)
                                               : outcome.kind == Outcome::Kind::kOutOfMemory;
}

void History::expect_accepted_state(const Operation& after) {
  if (const std::string differs = state_.difference(*collider_); !differs.empty())
    fail(after, "after it, " + differs);
  if (!(collider_->options() == options_)) fail(after, "after it, options() differ");
  if (const Status sound = collider_->self_check(); !sound)
    fail(after, "after it, the self-check: " + sound.error().message);
}

void History::fail(const Operation& operation, const std::string& what) {
  RC_FAIL(to_string(operation) + ": " + what + "\nin " + now_trying);
  std::abort();
}

}  // namespace warmfront::testing
