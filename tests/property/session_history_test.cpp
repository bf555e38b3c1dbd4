// SPDX-License-Identifier: Apache-2.0
// Histories of a collider: all operations, in any order, valid and invalid, cancelled, out of memory and over
// limits. The model is the sequence of accepted operations; each answer is compared with brute force.
// WARMFRONT_HISTORIES: number of histories (2,000); RC_PARAMS="seed=..." repeats a run, and a failure is
// reported as the shortest failing history found.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>

#include "engine/part_way.h"
#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"
#include "tests/support/failing_allocations.h"
#include "tests/support/replacements.h"

namespace warmfront::testing {
namespace {

// The next operation. Valid in every state, so that a history stays valid when some are removed.
struct Command {
  enum Kind : std::uint8_t {
    kFrame,
    kNothingMoves,
    kGlide,  // enough steps as a whole for bodies to be found rigid
    kAdd,
    kChange,
    kPlace,
    kSelfCheck,
    kForget,
    kResume,  // a fresh collider goes on from what was accepted
    kWrongFrame,
    kWrongChange,
    kWrongAddition,
    kWrongPlace,
    kOutlier,  // a vertex, or a body, is far away for a step
    kTrial,
    kLineSearch,  // trials of ever shorter motions, then perhaps a commit
    kMaxStep,
    kCommit,
    kWrongCommit,
    kNear,
    kFilters,
    kWrongFilters,
    kReplace,
    kWrongReplacement,
    kExcludedPairs,
    kOptions,
    kWrongOptions,
    kKinds
  };
  Kind kind = kFrame;
  std::uint32_t draw = 0;
  Fault fault;
};

std::ostream& operator<<(std::ostream& out, const Command& command) {
  constexpr const char* kNames[] = {
      "frame",          "nothing moves", "glide",        "add",           "change",       "place",
      "self_check",     "forget",        "resume",       "wrong frame",   "wrong change", "wrong addition",
      "wrong place",    "outlier",       "trial",        "line search",   "max_step",     "commit",
      "wrong commit",   "near",          "filters",      "wrong filters", "replace",      "wrong replacement",
      "excluded pairs", "options",       "wrong options"};
  return out << kNames[command.kind] << " drawn by " << command.draw << ", " << to_string(command.fault)
             << "\n";
}

rc::Gen<Command> any_command() {
  // Most faults come early in a call, where there is most to undo; some calls have hundreds of allocations.
  const auto n = rc::gen::oneOf(rc::gen::inRange<long>(0, 12), rc::gen::inRange<long>(0, 400));
  const auto fault_kind = rc::gen::weightedElement<Fault::Kind>({{6, Fault::Kind::kNone},
                                                                 {2, Fault::Kind::kAllocation},
                                                                 {1, Fault::Kind::kAllAllocations},
                                                                 {2, Fault::Kind::kCancelled}});
  const auto kind =
      rc::gen::map(rc::gen::weightedOneOf<int>({{3, rc::gen::just(int{Command::kFrame})},
                                                {2, rc::gen::just(int{Command::kLineSearch})},
                                                {1, rc::gen::just(int{Command::kReplace})},
                                                {4, rc::gen::inRange<int>(0, Command::kKinds)}}),
                   [](int k) { return static_cast<Command::Kind>(k); });
  return rc::gen::build<Command>(
      rc::gen::set(&Command::kind, kind),
      rc::gen::set(&Command::draw, rc::gen::inRange<std::uint32_t>(0, 1U << 30)),
      rc::gen::set(&Command::fault, rc::gen::build<Fault>(rc::gen::set(&Fault::kind, fault_kind),
                                                          rc::gen::set(&Fault::n, n))));
}

// For a crash: the history so far.
std::string now_trying;  // NOLINT: read by the handler below
[[noreturn]] void tell_and_end() {
  std::fprintf(stderr, "the process ended in: %s\n", now_trying.c_str());
  std::abort();
}
const auto installed = std::set_terminate(tell_and_end);

// Most are of a size near 1; some far from the origin, some very small or large.
AcceptedState draw_any_state(Draws& draws) {
  AcceptedState state = draw_state(draws);
  if (draws.below(4) != 0) return state;
  return scaled(std::move(state), std::ldexp(1, draws.below(2) == 0 ? 0 : 20 * (draws.below(41) - 20)),
                draws.below(3) * 1000.0);
}

ColliderOptions draw_options(Draws& draws, double unit) {
  ColliderOptions options;
  options.tier = draws.below(6) == 0 ? Tier::kExact : Tier::kCertified;
  options.front = static_cast<FrontMode>(draws.below(3));
  options.bounds = static_cast<BoundsKind>(draws.below(3));
  options.leaf_size = 1U << draws.below(7);
  if (draws.below(2) == 0) options.min_separation = 0.05 * unit;
  options.lazy_front = draws.below(2) == 0;
  options.separate_parts = draws.below(3) != 0;
  options.find_bodies = draws.below(3) != 0;
  options.find_rigid = draws.below(3) != 0;
  options.report = static_cast<Report>(draws.below(4));
  options.explain = draws.below(6) == 0;
  options.normal_cones = draws.below(4) == 0;
  options.fields = {.weights = draws.below(2) == 0,
                    .normal = draws.below(2) == 0,
                    .points = draws.below(2) == 0,
                    .direction = draws.below(3) == 0,
                    .squared_distance = draws.below(3) == 0,
                    .closest = draws.below(3) == 0};
  if (draws.below(4) == 0) options.max_front_bytes = static_cast<std::size_t>(draws.below(4096));
  if (draws.below(3) == 0) options.max_contacts = static_cast<std::size_t>(draws.below(30));
  return options;
}

// Where bodies may turn, no session is of tier exact.
ColliderOptions in_tier_of(const AcceptedState& state, ColliderOptions options) {
  if (state.may_turn) options.tier = Tier::kCertified;
  return options;
}

// Now and then one that is refused.
double draw_keep_distance(Draws& draws) {
  if (draws.below(12) == 0)
    return std::array{0.0, 1.0, -0.5, std::numeric_limits<double>::quiet_NaN()}[draws.below(4)];
  return std::array{0.5, 0.1, 0.9, 0x1p-30, 0.999}[draws.below(5)];
}

class History {
 public:
  History(std::uint64_t seed, std::shared_ptr<Workers> workers)
      : workers_(std::move(workers)),
        draws_(seed),
        state_(draw_any_state(draws_)),
        options_(in_tier_of(state_, draw_options(draws_, state_.unit))),
        collider_(std::make_unique<Collider>(state_.fresh(options_, workers_))) {
    now_trying = "a history of seed " + std::to_string(seed) + ":";
  }

  void take(const Command& command) {
    Draws draws(command.draw);
    switch (command.kind) {
      case Command::kFrame:
        return draws.below(6) == 0 ? place(draws, command.fault)
                                   : ask(draws, StepOperation::As::kStep, command.fault);
      case Command::kTrial:
        return ask(draws, StepOperation::As::kTrial, command.fault);
      case Command::kMaxStep:
        return ask(draws, StepOperation::As::kMaxStep, command.fault);
      case Command::kLineSearch:
        return line_search(draws, command.fault);
      case Command::kCommit:
        if (!state_.trial) return refuse(draw_commit(draws), command.fault, ErrorCode::kFailedPrecondition);
        return carry(draw_commit(draws), command.fault);
      case Command::kWrongCommit:
        return refuse(CommitOperation{draws.below(2) == 0 ? 1.0 + 0x1p-52 : std::nan("")}, command.fault);
      case Command::kNear: {
        NearOperation near = draw_near(draws, state_);
        if (!state_.trial && draws.below(8) == 0) {
          near = {0.1 * state_.unit, Where::kTrialEnd, {}};
          return refuse(near, command.fault, ErrorCode::kFailedPrecondition);
        }
        return carry(near, command.fault);
      }
      case Command::kFilters:
        return carry(draw_filters(draws, state_), command.fault);
      case Command::kWrongFilters:
        return refuse(
            ChangesOperation{{ChangeFilters{{.excluded_vertex_pairs = {{0, state_.scene.vertex_count}}}}}},
            command.fault);
      case Command::kExcludedPairs:
        return carry(ChangesOperation{{draw_excluded_pairs(draws, state_)}}, command.fault);
      case Command::kOptions:
        return change_options(draws, command.fault);
      case Command::kWrongOptions:
        return wrong_options(draws, command.fault);
      case Command::kReplace:
        return carry(draw_replacements(draws, state_), command.fault);
      case Command::kWrongReplacement:
        return refuse_one_of(draw_wrong_replacements(draws, state_), command.fault);
      case Command::kNothingMoves:
        return carry(StepOperation{}, command.fault);
      case Command::kGlide:
        return glide(draws, command.fault);
      case Command::kAdd:
        if (state_.scene.bodies.empty() || state_.scene.bodies.size() >= 8) return;
        return carry(draw_addition(draws, state_), command.fault);
      case Command::kChange:
        return change(draws, command.fault);
      case Command::kPlace:
        if (state_.stepped)
          return refuse(draw_place(draws, state_), command.fault, ErrorCode::kFailedPrecondition);
        return carry(draw_place(draws, state_), command.fault);
      case Command::kSelfCheck:
        return carry(CheckOperation{}, command.fault);
      case Command::kForget:
        return carry(ForgetOperation{}, command.fault);
      case Command::kResume:
        *collider_ = state_.fresh(options_, workers_);
        state_.stepped = false;
        state_.trial.reset();
        return;
      case Command::kWrongFrame:
        return refuse(spoiled(draws, state_, draw_step(draws, state_)), command.fault);
      case Command::kWrongChange:
        return refuse(wrong_change(draws), command.fault);
      case Command::kWrongAddition:
        return refuse(
            wrong_addition(draws), command.fault,
            state_.scene.bodies.empty() ? ErrorCode::kFailedPrecondition : ErrorCode::kInvalidArgument);
      case Command::kWrongPlace: {
        PlaceOperation place = draw_place(draws, state_);
        place.poses.push_back({static_cast<std::uint32_t>(state_.scene.bodies.size()), {}});
        return refuse(place, command.fault,
                      state_.stepped ? ErrorCode::kFailedPrecondition : ErrorCode::kInvalidArgument);
      }
      case Command::kOutlier:
        return outlier(draws, command.fault);
      case Command::kKinds:
        break;
    }
  }

  /// A session is charged memory_bytes(): no less than what the allocator holds for it.
  void end() {
    const std::size_t said = collider_->memory_bytes(), with = live_bytes();
    collider_.reset();
    const std::size_t held = with - live_bytes();
    if (said < held)
      RC_FAIL("memory_bytes() is " + std::to_string(said) + ", and the allocator held " +
              std::to_string(held) + " in " + now_trying);
  }

 private:
  void ask(Draws& draws, StepOperation::As as, const Fault& fault) {
    StepOperation step = draw_step(draws, state_);
    step.as = as;
    if (as != StepOperation::As::kStep || draws.below(3) == 0) step.options = draw_question(draws, state_);
    step.leave_out_overlaps = draws.below(2) == 0;
    if (draws.below(as == StepOperation::As::kMaxStep ? 2 : 12) == 0)
      step.options.keep_distance = draw_keep_distance(draws);
    carry(step, fault);
  }

  // Rarely with options, which it does not have.
  void place(Draws& draws, const Fault& fault) {
    StepOperation place = draw_step(draws, state_);
    place.as = StepOperation::As::kPlace;
    if (draws.below(8) == 0) place.options = draw_question(draws, state_);
    carry(place, fault);
  }

  CommitOperation draw_commit(Draws& draws) const {
    const double fraction = std::array{0.0, 1.0, 1.0, 0.5, 0.25, 0.7}[draws.below(6)];
    const bool single = state_.unit == 1 && draws.below(3) == 0;  // else it may leave float32's range
    return {fraction, single ? Rounding::kFloat32 : Rounding::kFloat64};
  }

  // The end of the motion is moved towards its start repeatedly.
  void line_search(Draws& draws, const Fault& fault) {
    StepOperation step = draw_step(draws, state_);
    step.as = StepOperation::As::kTrial;
    const int trials = 1 + draws.below(5);
    for (int i = 0; i < trials; ++i) {
      if (draws.below(3) == 0) step.options = draw_question(draws, state_);
      carry(step, i + 1 == trials ? fault : Fault{});
      if (!step.all) continue;
      for (std::size_t x = 0; x < step.all->size(); ++x)
        (*step.all)[x] = part_way(state_.positions[x], (*step.all)[x], 0.5, false);
    }
    if (state_.trial && draws.below(3) != 0) carry(draw_commit(draws), {});
  }

  // The answer that an operation must get when it meets no fault.
  Outcome right(const Operation& operation) const {
    if (const auto* near = std::get_if<NearOperation>(&operation)) return state_.brute_force(*near, options_);
    const auto* step = std::get_if<StepOperation>(&operation);
    return step == nullptr ? Outcome{} : state_.brute_force(*step, options_);
  }

  void carry(const Operation& operation, const Fault& fault) {
    now_trying += "\n  " + to_string(operation) + ", " + to_string(fault);
    const Outcome outcome = carry_out(*collider_, operation, fault);
    now_trying += ": " + to_string(outcome);
    if (!failed_by(fault, outcome)) {
      const Outcome expected = right(operation);
      if (const std::string differs = difference(outcome, expected); !differs.empty())
        fail(operation, differs);
      if (expected.done())
        accept(operation);
      else
        forget_trial(operation);
    } else {
      forget_trial(operation);
    }
    expect_accepted_state(operation);
  }

  void accept(const Operation& operation) {
    state_.accept(operation);
    const auto* changes = std::get_if<ChangesOperation>(&operation);
    if (changes != nullptr && changes->options) options_ = *changes->options;
  }

  // Alone, or with changes of the scene.
  void change_options(Draws& draws, const Fault& fault) {
    ChangesOperation changes;
    if (draws.below(3) == 0) changes = draw_filters(draws, state_);
    if (draws.below(3) == 0) changes.changes.emplace_back(draw_excluded_pairs(draws, state_));
    changes.options = in_tier_of(state_, draw_other_options(draws, options_, state_.unit));
    if (draws.below(4) == 0) changes.options->max_contacts = static_cast<std::size_t>(draws.below(30));
    if (draws.below(4) == 0) changes.options->max_front_bytes = static_cast<std::size_t>(draws.below(4096));
    carry(changes, fault);
  }

  // Changes that are right, with options that are not, and the other way round.
  void wrong_options(Draws& draws, const Fault& fault) {
    ChangesOperation changes = draw_filters(draws, state_);
    changes.options = in_tier_of(state_, draw_other_options(draws, options_, state_.unit));
    const auto body = static_cast<std::uint32_t>(state_.scene.bodies.size());
    switch (draws.below(5)) {
      case 0:
        changes.options->leaf_size = options_.leaf_size == 8 ? 4 : 8;
        break;
      case 1:
        changes.options->explain = !options_.explain;
        break;
      case 2:
        changes.options->tolerance = 0;
        break;
      case 3:
        changes.options->keep_distance = 0.5;
        break;
      default:
        changes.changes.emplace_back(ChangeExcludedPairs{{{body, body + 1}}});
        break;
    }
    refuse(changes, fault);
  }

  void refuse(const Operation& operation, const Fault& fault, ErrorCode code = ErrorCode::kInvalidArgument) {
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
  void refuse_one_of(const ChangesOperation& changes, const Fault& fault) {
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
  void forget_trial(const Operation& failed) {
    const bool keeps =
        std::holds_alternative<CheckOperation>(failed) || std::holds_alternative<ForgetOperation>(failed) ||
        std::holds_alternative<NearOperation>(failed) || std::holds_alternative<CommitOperation>(failed);
    if (!keeps) state_.trial.reset();
  }

  static bool failed_by(const Fault& fault, const Outcome& outcome) {
    if (!outcome.met_fault) return false;
    return fault.kind == Fault::Kind::kCancelled ? outcome.refused(ErrorCode::kCancelled)
                                                 : outcome.kind == Outcome::Kind::kOutOfMemory;
  }

  void expect_accepted_state(const Operation& after) {
    if (const std::string differs = state_.difference(*collider_); !differs.empty())
      fail(after, "after it, " + differs);
    if (!(collider_->options() == options_)) fail(after, "after it, options() differ");
    if (const Status sound = collider_->self_check(); !sound)
      fail(after, "after it, the self-check: " + sound.error().message);
  }

  [[noreturn]] static void fail(const Operation& operation, const std::string& what) {
    RC_FAIL(to_string(operation) + ": " + what + "\nin " + now_trying);
    std::abort();
  }

  // All that may move does so as a whole, by sums that are exact.
  void glide(Draws& draws, const Fault& fault) {
    const int steps = 1 + draws.below(20);
    const double unit = state_.unit * 0x1p-7;
    const double by[3] = {draws.below(9) * unit, draws.below(9) * unit, -draws.below(9) * unit};
    for (int i = 0; i < steps; ++i) {
      StepOperation step;
      step.all = state_.positions;
      for (std::size_t b = 0; b < state_.scene.bodies.size() || b == 0; ++b) {
        if (!state_.scene.bodies.empty() && state_.fixed(b)) continue;
        const Body whole{"", 0, state_.scene.vertex_count};
        const Body& body = state_.scene.bodies.empty() ? whole : state_.scene.bodies[b];
        for (std::uint32_t v = body.first_vertex; v < body.first_vertex + body.vertex_count; ++v) {
          for (int axis = 0; axis < 3; ++axis) (*step.all)[std::size_t{3} * v + axis] += by[axis];
        }
      }
      // The fault occurs during the rigid motion, and once more after a long rigid motion.
      carry(step, i + 3 > steps ? fault : Fault{});
    }
  }

  void outlier(Draws& draws, const Fault& fault) {
    const double far = state_.unit * std::ldexp(1, 10 * (1 + draws.below(6)));
    const std::vector<double> home = state_.positions;
    StepOperation away = everything(home), back = everything(home);
    if (movable(0)) (*away.all)[static_cast<std::size_t>(draws.below(3))] += far;
    carry(away, fault);
    carry(back, fault);
  }

  static StepOperation everything(const std::vector<double>& positions) {
    StepOperation step;
    step.all = positions;
    return step;
  }
  // A vertex's body.
  bool movable(std::uint32_t vertex) const {
    if (state_.scene.bodies.empty()) return true;
    std::size_t body = 0;
    while (vertex >= state_.scene.bodies[body].first_vertex + state_.scene.bodies[body].vertex_count) ++body;
    return !state_.fixed(body);
  }

  void change(Draws& draws, const Fault& fault) {
    if (state_.scene.bodies.empty()) return;
    const ChangeOperation change = draw_change(draws, state_);
    if (state_.scene.bodies[change.body].kind == BodyKind::kRemoved) return refuse(change, fault);
    carry(change, fault);
  }

  ChangeOperation wrong_change(Draws& draws) const {
    const auto bodies = static_cast<std::uint32_t>(state_.scene.bodies.size());
    if (bodies == 0 || draws.below(2) == 0) return {bodies + static_cast<std::uint32_t>(draws.below(3)), {}};
    ChangeOperation change = draw_change(draws, state_);
    change.as.mask = 0;
    return change;
  }

  AddOperation wrong_addition(Draws& draws) const {
    AddOperation add = draw_addition(draws, state_);
    if (add.addition.body.half_space) {
      switch (draws.below(4)) {
        case 0:
          add.addition.edges.push_back({0, 1});
          break;
        case 1:
          add.positions.push_back(0);
          break;
        case 2:
          add.addition.body.half_space->normal = {};
          break;
        default:
          add.addition.body.kind = BodyKind::kDeformable;
          break;
      }
      return add;
    }
    switch (draws.below(3)) {
      case 0:
        add.addition.faces.push_back({0, 1, static_cast<std::int32_t>(add.addition.body.vertex_count)});
        break;
      case 1:
        add.positions.pop_back();
        break;
      default:
        add.positions.back() = std::numeric_limits<double>::quiet_NaN();
        break;
    }
    return add;
  }

  const std::shared_ptr<Workers> workers_;
  Draws draws_;
  AcceptedState state_;
  ColliderOptions options_;
  std::unique_ptr<Collider> collider_;
};

// Runs `histories` histories on `threads` threads.
void check_histories(const char* name, int threads, int histories) {
  const auto workers = std::make_shared<Workers>(threads);
  rc::detail::TestMetadata metadata;
  metadata.id = metadata.description = name;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  if (params.maxSuccess == rc::detail::TestParams{}.maxSuccess) params.maxSuccess = histories;
  long commands = 0;
  const auto result = rc::detail::checkTestable(
      [&] {
        const auto seed = *rc::gen::inRange<std::uint32_t>(0, 1U << 30);
        const auto all = *rc::gen::resize(20, rc::gen::container<std::vector<Command>>(any_command()));
        History history(seed, workers);
        for (const Command& command : all) {
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

int histories() {
  const char* text = std::getenv("WARMFRONT_HISTORIES");
  return text == nullptr ? 2000 : std::atoi(text);
}

TEST(SessionHistory, IsWhatItsAcceptedOperationsMakeOfIt) {
  check_histories("one thread", 1, histories());
}

// Which allocation fails then depends on the threads; what follows does not.
TEST(SessionHistory, IsThatOnTwoThreads) {
  check_histories("two threads", 2, histories() / 4);
}

}  // namespace
}  // namespace warmfront::testing
