// SPDX-License-Identifier: Apache-2.0
// Histories of a session over two daemons, behind an address that leads to either: frames and changes, valid
// and invalid, while connections are cut, answers lost, daemons killed, frozen and resumed. The model is the
// list of accepted operations; each answer is compared with brute force. With either client.
// WARMFRONT_REMOTE_HISTORIES: number of histories (40); RC_PARAMS="seed=..." repeats a run.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <signal.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <optional>

#include "client/lib/client.h"
#include "engine/part_way.h"
#include "tests/faults/history_daemons.h"
#include "tests/faults/remote_command.h"
#include "tests/faults/remote_session.h"
#include "tests/faults/rounded.h"
#include "tests/faults/switch_proxy.h"
#include "tests/support/replacements.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using testing::AcceptedState;
using testing::Draws;
using testing::StepOperation;

TwoDaemons& daemons() {
  static TwoDaemons both;
  return both;
}

ColliderOptions draw_options(Draws& draws) {
  ColliderOptions options;
  options.report = static_cast<Report>(draws.below(3));
  if (draws.below(2) == 0) options.min_separation = 0.05;
  options.fields = {draws.below(2) == 0, draws.below(2) == 0, draws.below(2) == 0};
  options.front = static_cast<FrontMode>(draws.below(3));
  options.find_bodies = draws.below(2) == 0;
  return options;
}

// To a daemon that may be being started.
std::optional<client::Client> connect(const std::string& address) {
  for (int i = 0; i < 20; ++i) {
    if (auto client = client::Client::connect(address); client.ok()) return std::move(client).value();
  }
  RC_FAIL("no daemon answers at " + address);
  return std::nullopt;
}

class RemoteHistory {
 public:
  RemoteHistory(SessionDriver& driver, std::uint64_t seed)
      : driver_(driver),
        draws_(seed),
        rounded_(driver.single()),
        session_(driver, rounded_.of(testing::draw_state(draws_)), draw_options(draws_),
                 TwoDaemons::kFewContacts) {
    daemons().thaw();
    expect_right(session_.create());
    if (daemons().offers_memory() && !daemons().shares_memory()) expect_right("no memory is shared");
  }

  void take(const RemoteCommand& command) {
    Draws draws(command.draw);
    std::ostringstream told;
    told << "\n  " << command;
    log_ += told.str();
    expect_right(session_.check_state());
    const AcceptedState& state = session_.state();
    const bool bodies = !state.scene.bodies.empty();
    const Around around =
        command.lose_answer ? Around([this](const auto& call) { lose_answer_of(call); }) : Around(as_it_is);
    switch (command.kind) {
      case RemoteCommand::kFrame: {
        StepOperation frame = rounded_.of(draw_step(draws, state));
        if (driver_.asks() && draws.below(5) == 0) frame.as = StepOperation::As::kPlace;
        return expect_right(session_.step(frame, around));
      }
      case RemoteCommand::kTwoFrames:
        return two_steps(draws, command.lose_answer);
      case RemoteCommand::kAdd:
        if (!bodies || state.scene.bodies.size() >= 8) return;
        return expect_right(session_.add(rounded_.of(testing::draw_addition(draws, state)), around));
      case RemoteCommand::kChange:
        if (!bodies) return;
        return expect_right(session_.change(testing::draw_change(draws, state), around));
      case RemoteCommand::kWrongFrame:
        return expect_right(
            session_.wrong_step(testing::spoiled(draws, state, rounded_.of(draw_step(draws, state)))));
      case RemoteCommand::kWrongChange:
        return expect_right(session_.wrong_change());
      case RemoteCommand::kCut:
        return daemons().cut();
      case RemoteCommand::kSwitch:
        return daemons().go_to_the_other();
      case RemoteCommand::kKill:
        return daemons().kill_in_use();
      case RemoteCommand::kFreeze:
        return daemons().freeze_in_use();
      case RemoteCommand::kThaw:
        return daemons().thaw();
      case RemoteCommand::kTrial:
        return ask(draws, StepOperation::As::kTrial, around);
      case RemoteCommand::kMaxStep:
        return ask(draws, StepOperation::As::kMaxStep, around);
      case RemoteCommand::kLineSearch:
        return line_search(draws, around);
      case RemoteCommand::kCommit:
        if (driver_.asks()) expect_right(session_.commit(draw_fraction(draws), around));
        return;
      case RemoteCommand::kNear:
        return near(draws, around);
      case RemoteCommand::kTrialCommitStep:
        return trial_commit_step(draws, command.lose_answer);
      case RemoteCommand::kFilters:
        return expect_right(session_.change_filters(draw_filters(draws), around));
      case RemoteCommand::kReplace: {
        const std::optional<SceneChange> change = testing::draw_replacement(draws, state);
        if (change) expect_right(session_.replace(rounded_.of(*change), around));
        return;
      }
      case RemoteCommand::kExcludedPairs:
        return expect_right(
            session_.change_excluded_pairs(testing::draw_excluded_pairs(draws, state), around));
      case RemoteCommand::kOptions:
        return expect_right(session_.change_options(draw_other_options(draws), around));
      case RemoteCommand::kWrongOptions:
        return expect_right(session_.wrong_options());
      case RemoteCommand::kWrongReplacement:
        return expect_right(session_.wrong_replacement());
      case RemoteCommand::kWrongFilters:
        return expect_right(session_.wrong_filters());
      case RemoteCommand::kJourney:
        return journey(draws, around);
      case RemoteCommand::kKinds:
        break;
    }
  }

  void end() {
    expect_right(session_.step({}));
    expect_right(session_.check_state());
    daemons().thaw();
    expect_right(session_.close());
  }

 private:
  // What the session has done in the daemon in use, in a number that changes with it.
  std::uint64_t done_there(client::Client& direct) const {
    const auto info = direct.get_session(driver_.id());
    return info.ok() ? 1000 * (info.value().last_frame + info.value().steps) + info.value().body_count : 0;
  }

  /// Runs the call until the daemon has done what it asks for, or it is clear that it will not; then the
  /// other daemon takes over. Only the timing depends on that: the result is the same whenever it is cut.
  void lose_answer_of(const std::function<void()>& call) {
    std::optional<client::Client> direct = connect(daemons().address_in_use());
    const std::uint64_t before = done_there(*direct);
    daemons().lose_answers();
    auto called = std::async(std::launch::async, call);
    for (int i = 0; i < 30 && called.wait_for(10ms) != std::future_status::ready; ++i) {
      if (done_there(*direct) != before) break;
    }
    daemons().go_to_the_other();
    called.get();
  }

  void two_steps(Draws& draws, bool lose_answer) {
    if (driver_.window() < 2) return;
    AcceptedState next = session_.state();
    const StepOperation first = rounded_.of(draw_step(draws, next));
    next.accept(first);
    const StepOperation second = rounded_.of(draw_step(draws, next));
    expect_right(session_.two_steps(first, second, [lose_answer] {
      if (lose_answer) daemons().go_to_the_other();
    }));
  }

  PairFilters draw_filters(Draws& draws) const {
    return std::get<ChangeFilters>(testing::draw_filters(draws, session_.state()).changes.front()).filters;
  }

  // The daemons allow different numbers of rows of different fields.
  ColliderOptions draw_other_options(Draws& draws) const {
    const ColliderOptions& options = session_.options();
    ColliderOptions other = testing::draw_other_options(draws, options, session_.state().unit);
    other.lazy_front = options.lazy_front;
    other.separate_parts = options.separate_parts;
    other.find_rigid = options.find_rigid;
    if (session_.state().may_turn) other.tier = Tier::kCertified;
    return other;
  }

  static double draw_fraction(Draws& draws) {
    return std::array{0.0, 1.0, 1.0, 0.5, 0.25, 0.7}[draws.below(6)];
  }

  StepOperation draw_trial(Draws& draws, StepOperation::As as) const {
    StepOperation trial = rounded_.of(draw_step(draws, session_.state()));
    trial.as = as;
    trial.options = testing::draw_question(draws, session_.state());
    trial.options.max_contacts.reset();  // the daemons allow different ones
    if (as == StepOperation::As::kMaxStep) {
      trial.options.report.reset();
      trial.options.fields.reset();
      trial.leave_out_overlaps = draws.below(2) == 0;
      const bool touching = trial.options.tier == Tier::kFast;
      if (draws.below(2) == 0 && !touching)
        trial.options.keep_distance = std::array{0.5, 0.1, 0.9}[draws.below(3)];
    }
    return trial;
  }

  void ask(Draws& draws, StepOperation::As as, const Around& around) {
    if (driver_.asks()) expect_right(session_.step(draw_trial(draws, as), around));
  }

  void journey(Draws& draws, const Around& around) {
    if (!driver_.asks()) return;
    const double unit = std::ldexp(1.0, draws.below(13) - 6), far = std::ldexp(unit, draws.below(21));
    StepOperation there = rounded_.of(testing::draw_journey(draws, session_.state(), unit, far));
    there.as = StepOperation::As::kPlace;
    expect_right(session_.step(there, around));
    session_.draw_near(unit, far);
  }

  void near(Draws& draws, const Around& around) {
    if (!driver_.asks()) return;
    testing::NearOperation near = testing::draw_near(draws, session_.state());
    near.options.max_contacts.reset();  // the daemons allow different ones
    if (draws.below(4) == 0) near.where = Where::kTrialEnd;
    expect_right(session_.near(near, around));
  }

  void line_search(Draws& draws, const Around& around) {
    if (!driver_.asks()) return;
    StepOperation trial = draw_trial(draws, StepOperation::As::kTrial);
    const int trials = 1 + draws.below(3);
    for (int i = 0; i < trials; ++i) {
      expect_right(session_.step(trial));
      if (!trial.all) continue;
      for (std::size_t x = 0; x < trial.all->size(); ++x)
        (*trial.all)[x] = part_way(session_.state().positions[x], (*trial.all)[x], 0.5, driver_.single());
    }
    // In the meantime the daemon may be another one.
    if (draws.below(2) == 0) daemons().go_to_the_other();
    expect_right(session_.commit(draw_fraction(draws), around));
  }

  void trial_commit_step(Draws& draws, bool lose_answer) {
    if (!driver_.asks() || driver_.window() < 3) return;
    AcceptedState next = session_.state();
    const StepOperation trial = draw_trial(draws, StepOperation::As::kTrial);
    const double fraction = draw_fraction(draws);
    next.accept(trial);
    next.accept(testing::CommitOperation{fraction, session_.rounding()});
    const StepOperation step = rounded_.of(draw_step(draws, next));
    expect_right(session_.trial_commit_step(trial, fraction, step, [lose_answer] {
      if (lose_answer) daemons().go_to_the_other();
    }));
  }

  void expect_right(const std::string& wrong) const {
    if (wrong.empty()) return;
    // Told at once, too: what depends on when a daemon answered may not fail a second time.
    std::fprintf(stderr, "%s\nin%s\n", wrong.c_str(), log_.c_str());
    RC_FAIL(wrong);
  }

  SessionDriver& driver_;
  Draws draws_;
  const Rounded rounded_;
  RemoteSession session_;
  std::string log_;
};

void check_histories(const char* name, SessionDriver& driver) {
  const char* text = std::getenv("WARMFRONT_REMOTE_HISTORIES");
  rc::detail::TestMetadata metadata;
  metadata.id = metadata.description = name;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  if (params.maxSuccess == rc::detail::TestParams{}.maxSuccess)
    params.maxSuccess = text == nullptr ? 40 : std::atoi(text);
  long commands = 0;
  const auto result = rc::detail::checkTestable(
      [&] {
        const auto seed = *rc::gen::inRange<std::uint32_t>(0, 1U << 30);
        const auto all = *rc::gen::resize(20, rc::gen::container<std::vector<RemoteCommand>>(any_command()));
        RemoteHistory history(driver, seed);
        for (const RemoteCommand& command : all) {
          ++commands;
          history.take(command);
        }
        history.end();
      },
      metadata, params);
  std::ostringstream told;
  rc::detail::printResultMessage(result, told);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << told.str();
  std::printf("%s; %ld commands\n", told.str().c_str(), commands);
}

TEST(RemoteHistory, OfTheCppClientIsWhatWasAccepted) {
  check_histories("C++", *drive_cpp(daemons().address()));
}

TEST(RemoteHistory, OfTheCppClientInFloat32IsWhatWasAccepted) {
  check_histories("C++, float32", *drive_cpp_in_float32(daemons().address()));
}

/// Positions and answers go through memory that a client shares with the daemon.
class SharedMemory {
 public:
  SharedMemory() { daemons().share_memory(true); }
  ~SharedMemory() { daemons().share_memory(false); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
};

TEST(RemoteHistory, OfTheCppClientIsWhatWasAcceptedThroughSharedMemory) {
  const SharedMemory shared;
  check_histories("C++, shared memory", *drive_cpp(daemons().address()));
}

#ifdef WARMFRONT_PYTHON
TEST(RemoteHistory, OfThePythonClientIsWhatWasAccepted) {
  check_histories("Python", *drive_python(daemons().address()));
}

TEST(RemoteHistory, OfThePythonClientIsWhatWasAcceptedThroughSharedMemory) {
  const SharedMemory shared;
  check_histories("Python, shared memory", *drive_python(daemons().address()));
}
#endif

}  // namespace
}  // namespace warmfront::test
