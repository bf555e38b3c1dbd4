// SPDX-License-Identifier: Apache-2.0
// Every failure at every place: each operation of short scripts meets every possible failure: the n-th
// allocation fails, alone or with all later ones, the step is cancelled at the n-th look at its flag, or it
// has more than k contacts, for every n and k. The collider must then be, bit for bit, as before the call,
// and behave like one without the failure. WARMFRONT_FAULT_SEEDS: number of additional random scripts (6).
#include <gtest/gtest.h>

#include <cstdio>
#include <map>

#include "tests/faults/fault_scripts.h"
#include "tests/faults/now_trying.h"
#include "tests/faults/place.h"
#include "tests/faults/small_sheets.h"
#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/scenes.h"

namespace warmfront::testing {
namespace {

class EveryPlace : public ::testing::TestWithParam<Script> {
 protected:
  // All there are of a kind, at every operation.
  static void meet_every(Fault::Kind kind) {
    const Script& script = GetParam();
    long met = 0;
    for (std::size_t at = script.first; at < script.operations.size(); ++at) {
      Place place(script, at);
      SCOPED_TRACE(place.name());
      place.learn();
      if (HasFatalFailure()) return;
      Fault fault{kind};
      for (bool more = true; more && !HasFailure(); ++fault.n) {
        SCOPED_TRACE(to_string(fault));
        more = place.meet(fault);
      }
      if (HasFailure()) return;
      met += fault.n - 1;
      place.meet_all({kind}, fault.n - 1);
    }
    std::printf("%s: %ld faults met\n", script.name.c_str(), met);
  }
};
std::string name_of(const ::testing::TestParamInfo<Script>& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return c == ','; });
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Scripts, EveryPlace, ::testing::ValuesIn(fault_scripts()), name_of);

TEST_P(EveryPlace, AnAllocationFails) {
  meet_every(Fault::Kind::kAllocation);
}

TEST_P(EveryPlace, AllAllocationsFailFromThereOn) {
  meet_every(Fault::Kind::kAllAllocations);
}

TEST_P(EveryPlace, CancelledAtEveryLook) {
  meet_every(Fault::Kind::kCancelled);
}

// Answers by brute force, each worked out once however many contacts are allowed.
class KnownAnswers {
 public:
  Outcome of(const AcceptedState& state, const StepOperation& step, ColliderOptions options) {
    if (step.as != StepOperation::As::kStep || step.options != QuestionOptions{})
      return state.brute_force(step, options);
    const std::size_t most = options.max_contacts;
    options.max_contacts = ColliderOptions{}.max_contacts;
    AcceptedState after = state;
    after.accept(step);
    std::vector<double> key = state.positions;
    key.insert(key.end(), {options.min_separation, static_cast<double>(options.tier)});
    for (const auto& [a, b] : state.scene.excluded_pairs) key.insert(key.end(), {1.0 * a, 1.0 * b});
    key.insert(key.end(), after.positions.begin(), after.positions.end());
    for (const Body& body : state.scene.bodies)
      key.insert(key.end(), {static_cast<double>(body.kind), body.screw ? 1.0 : 0.0});
    // Where a half-space is, and along which arc a vertex moves, positions do not tell.
    for (const AcceptedState* of : {&state, &std::as_const(after)}) {
      for (const std::optional<Pose>& pose : of->pose) {
        const Pose at = pose.value_or(Pose{});
        key.insert(key.end(), at.matrix.begin(), at.matrix.end());
      }
    }
    for (const auto& face : state.scene.faces) key.insert(key.end(), face.begin(), face.end());
    for (const auto& edge : state.scene.edges) key.insert(key.end(), edge.begin(), edge.end());
    const auto [known, added] = known_.try_emplace(std::move(key));
    if (added) known->second = state.brute_force(step, options);
    if (options.report == Report::kCount || known->second.contacts.size() <= most) return known->second;
    Outcome refused;
    refused.kind = Outcome::Kind::kRefused;
    refused.error.code = ErrorCode::kResourceExhausted;
    return refused;
  }

 private:
  std::map<std::vector<double>, Outcome> known_;
};

// A failed create() leaks nothing.
TEST_P(EveryPlace, WhileItIsMade) {
  const Script& script = GetParam();
  const auto scene = std::make_shared<const Scene>(Scene::create(script.start.scene).value());
  const std::span<const double> positions = script.start.positions;
  const auto workers = one_thread();
  // Allocations that only the first collider of the process makes.
  ASSERT_TRUE(Collider::create(scene, positions, script.options, workers).ok());
  long n = 0;
  for (bool failed = true; failed; ++n) {
    now_trying = script.name + ", create(), allocation " + std::to_string(n);
    const std::size_t before = live_bytes();
    failed = false;
    const FailingAllocations failing(n);
    try {
      const auto collider = Collider::create(scene, positions, script.options, workers);
      EXPECT_TRUE(collider.ok());
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    ASSERT_TRUE(failed || !FailingAllocations::met()) << "allocation " << n << " failed unseen";
    ASSERT_EQ(live_bytes(), before) << "after allocation " << n << " failed";
  }
  std::printf("%s: %ld faults met\n", script.name.c_str(), n - 1);
}

// The script with max_contacts k, for every k: a refused operation has no effect, and the others continue
// from there.
bool moves_static_body(const AcceptedState& state, const StepOperation& step) {
  if (!step.all) return false;
  return std::ranges::any_of(state.scene.bodies, [&](const Body& body) {
    const auto first = static_cast<std::ptrdiff_t>(3 * body.first_vertex);
    return body.kind == BodyKind::kStatic &&
           !std::equal(state.positions.begin() + first,
                       state.positions.begin() + first + 3 * body.vertex_count, step.all->begin() + first);
  });
}

TEST_P(EveryPlace, MoreContactsThanAllowed) {
  const Script& script = GetParam();
  KnownAnswers answers;
  long refusals = 0;
  bool refused = true;
  for (std::size_t k = 0; refused; ++k) {
    SCOPED_TRACE("max_contacts " + std::to_string(k));
    ColliderOptions options = script.options;
    options.max_contacts = k;
    Collider collider = script.start.fresh(options, one_thread());
    AcceptedState state = script.start;
    refused = false;
    const auto expect_right = [&](const Operation& operation) {
      SCOPED_TRACE(to_string(operation));
      const Outcome outcome = carry_out(collider, operation);
      if (const auto* step = std::get_if<StepOperation>(&operation)) {
        ASSERT_EQ(difference(outcome, answers.of(state, *step, options)), "");
      }
      const auto* near = std::get_if<NearOperation>(&operation);
      const bool of_trial = std::holds_alternative<CommitOperation>(operation) ||
                            (near != nullptr && near->where == Where::kTrialEnd);
      const bool no_trial = of_trial && !state.trial;
      if (near != nullptr && !no_trial) {
        ASSERT_EQ(difference(outcome, state.brute_force(*near, options)), "");
      }
      ASSERT_TRUE(outcome.done() ||
                  outcome.refused(no_trial ? ErrorCode::kFailedPrecondition : ErrorCode::kResourceExhausted))
          << to_string(outcome);
      ASSERT_FALSE(no_trial && outcome.done());
      refused |= !outcome.done();
      if (!outcome.done() && near == nullptr) state.trial.reset();
      refusals += outcome.done() ? 0 : 1;
      if (outcome.done()) {
        state.accept(operation);
        options = options_after(operation, options);
      }
      ASSERT_EQ(state.difference(collider), "");
    };
    for (Operation operation : script.operations) {
      auto* changes = std::get_if<ChangesOperation>(&operation);
      if (changes != nullptr && changes->options) changes->options->max_contacts = k;
      // What moved a body in a frame that was refused here does not lead to where the script has it, static.
      const auto* step = std::get_if<StepOperation>(&operation);
      if (step != nullptr && moves_static_body(state, *step)) break;
      ASSERT_NO_FATAL_FAILURE(expect_right(operation));
    }
    Draws draws(k % 4);
    for (int i = 0; i < kStepsAfter; ++i)
      ASSERT_NO_FATAL_FAILURE(expect_right(Operation(draw_step(draws, state))));
  }
  std::printf("%s: %ld faults met\n", script.name.c_str(), refusals);
}

// Which allocation fails depends on the threads; the outcome must not.
TEST_P(EveryPlace, OnTwoThreads) {
  const Script& script = GetParam();
  const auto workers = std::make_shared<Workers>(2);
  for (std::size_t at = script.first; at < script.operations.size(); at += 2) {
    Place place(script, at, workers);
    SCOPED_TRACE(place.name());
    place.learn();
    for (const Fault::Kind kind : {Fault::Kind::kAllocation, Fault::Kind::kCancelled}) {
      for (long n = 0; n < 40 && !HasFailure(); ++n) {
        const Fault fault{kind, n * n / 4};
        SCOPED_TRACE(to_string(fault));
        if (!place.meet(fault)) break;
      }
    }
  }
}

// A question that ran out of memory as it began knows of some of the parts that were added, and not of others.
TEST(PlaceAfterAFailure, ReadsNoPartThatWasNotAdded) {
  Script script{"placed after a failure",
                {two_bodies(BodyKind::kDeformable, BodyKind::kRigid, 2), joined(sheet(2, 0), sheet(2, 0.3))},
                {},
                {}};
  const Body body{"a", 0, 9, BodyKind::kDeformable};
  const AddOperation added{{body, grid(2)}, sheet(2, 0.4)};
  const std::vector<double> low = joined(joined(sheet(2, 0), sheet(2, 0.2)), sheet(2, 0.1));
  const StepOperation step = everything(low);
  StepOperation place = everything(joined(joined(sheet(2, 0), sheet(2, 0.3)), sheet(2, 0.5)));
  place.as = StepOperation::As::kPlace;
  bool failed = true;
  for (long n = 0; failed; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n));
    Collider collider = script.start.fresh(script.options, one_thread());
    AcceptedState state = script.start;
    const auto take = [&](const Operation& operation) {
      ASSERT_TRUE(carry_out(collider, operation).done());
      state.accept(operation);
    };
    ASSERT_NO_FATAL_FAILURE(take(everything(joined(sheet(2, 0.1), sheet(2, 0.35)))));
    ASSERT_NO_FATAL_FAILURE(take(added));
    failed = !carry_out(collider, step, {Fault::Kind::kAllocation, n}).done();
    if (!failed) break;
    ASSERT_NO_FATAL_FAILURE(take(place));
    ASSERT_EQ(difference(carry_out(collider, step), state.brute_force(step, script.options)), "");
  }
}

}  // namespace
}  // namespace warmfront::testing
