// SPDX-License-Identifier: Apache-2.0
// What each command comes to.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/part_way.h"
#include "tests/property/session_history.h"
#include "tests/support/replacements.h"

namespace warmfront::testing {

void History::take(const Command& command) {
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
      if (state_.scene.bodies.empty() || state_.scene.bodies.size() >= most_bodies_) return;
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
    case Command::kJourney:
      return journey(draws, command.fault);
    case Command::kNoise:
      return noise(draws, command.fault);
    case Command::kKinds:
      break;
  }
}

void History::ask(Draws& draws, StepOperation::As as, const Fault& fault) {
  StepOperation step = draw_step(draws, state_);
  step.as = as;
  if (as != StepOperation::As::kStep || draws.below(3) == 0) step.options = draw_question(draws, state_);
  step.leave_out_overlaps = draws.below(2) == 0;
  if (draws.below(as == StepOperation::As::kMaxStep ? 2 : 12) == 0)
    step.options.keep_distance = draw_keep_distance(draws);
  carry(step, fault);
}

// Rarely with options, which it does not have.
void History::place(Draws& draws, const Fault& fault) {
  StepOperation place = draw_step(draws, state_);
  place.as = StepOperation::As::kPlace;
  if (draws.below(8) == 0) place.options = draw_question(draws, state_);
  carry(place, fault);
}

// Else what is drawn may leave its range.
bool History::fits_float32() const {
  return std::max(state_.unit, std::abs(state_.offset)) < 1e20 && state_.unit > 1e-20;
}

CommitOperation History::draw_commit(Draws& draws) const {
  const double fraction = std::array{0.0, 1.0, 1.0, 0.5, 0.25, 0.7}[draws.below(6)];
  const bool single = fits_float32() && draws.below(3) == 0;
  return {fraction, single ? Rounding::kFloat32 : Rounding::kFloat64};
}

// Trials of a motion, again or of half of it, and in between what a solver asks about where they end.
void History::line_search(Draws& draws, const Fault& fault) {
  StepOperation step = draw_step(draws, state_);
  step.as = StepOperation::As::kTrial;
  const int trials = 1 + draws.below(5);
  for (int i = 0; i < trials; ++i) {
    if (draws.below(3) == 0) step.options = draw_question(draws, state_);
    carry(step, i + 1 == trials ? fault : Fault{});
    if (draws.below(3) == 0) carry(draw_near(draws, state_), {});
    if (!step.all || draws.below(4) == 0) continue;
    for (std::size_t x = 0; x < step.all->size(); ++x)
      (*step.all)[x] = part_way(state_.positions[x], (*step.all)[x], 0.5, false);
  }
  if (state_.trial && draws.below(3) != 0) carry(draw_commit(draws), {});
}

// Alone, or with changes of the scene.
void History::change_options(Draws& draws, const Fault& fault) {
  ChangesOperation changes;
  if (draws.below(3) == 0) changes = draw_filters(draws, state_);
  if (draws.below(3) == 0) changes.changes.emplace_back(draw_excluded_pairs(draws, state_));
  changes.options = in_tier_of(state_, draw_other_options(draws, options_, state_.unit));
  if (draws.below(4) == 0) changes.options->max_contacts = static_cast<std::size_t>(draws.below(30));
  if (draws.below(4) == 0) changes.options->max_front_bytes = static_cast<std::size_t>(draws.below(4096));
  carry(changes, fault);
}

// Changes that are right, with options that are not, and the other way round.
void History::wrong_options(Draws& draws, const Fault& fault) {
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

// All that may move does so as a whole, by sums that are exact.
void History::glide(Draws& draws, const Fault& fault) {
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

// All that may move goes elsewhere, grows or shrinks; from there on, all that is drawn is of that size and
// place. What is asked there on the way to somewhere else is long beside the scene as it was made.
void History::journey(Draws& draws, const Fault& fault) {
  if (state_.travels == AcceptedState::Travels::kNot) return;
  const double unit = std::ldexp(state_.unit, draws.below(3) == 0 ? draws.below(16) - 8 : 0);
  if (unit < 0x1p-300 || unit > 0x1p300) return;
  // Where float32 puts whole meshes in one place, what certified reports depends on how pairs are found, too.
  const bool moves = state_.travels == AcceptedState::Travels::kMoving;
  const double far =
      draws.below(3) == 0 ? 0 : std::ldexp(unit, draws.below(moves ? 27 : 16)) * (1 + draws.uniform(0.5));
  StepOperation there = draw_journey(draws, state_, unit, far);
  there.as = !moves                ? StepOperation::As::kPlace
             : draws.below(2) == 0 ? StepOperation::As::kStep
                                   : StepOperation::As::kTrial;
  carry(there, fault);
  if (there.as == StepOperation::As::kTrial && state_.trial && draws.below(2) == 0)
    return carry(CommitOperation{0.0}, {});
  if (moves) there.as = StepOperation::As::kStep;
  carry(there, {});
  state_.unit = unit;
  state_.offset = far;
  for (int i = draws.below(5); i > 0 && fits_float32(); --i) {
    StepOperation step = draw_step(draws, state_);
    step.as = StepOperation::As::kTrial;
    carry(step, {});
    if (state_.trial)
      carry(CommitOperation{std::array{0.25, 0.5, 0.7}[draws.below(3)], Rounding::kFloat32}, {});
  }
}

void History::noise(Draws& draws, const Fault& fault) {
  StepOperation step = draw_noise(draws, state_);
  step.as = StepOperation::As::kTrial;
  carry(step, fault);
  if (state_.trial) carry(draw_commit(draws), {});
}

void History::outlier(Draws& draws, const Fault& fault) {
  const double far = state_.unit * std::ldexp(1, 10 * (1 + draws.below(6)));
  const std::vector<double> home = state_.positions;
  StepOperation away = everything(home), back = everything(home);
  if (movable(0)) (*away.all)[static_cast<std::size_t>(draws.below(3))] += far;
  carry(away, fault);
  carry(back, fault);
}

StepOperation History::everything(const std::vector<double>& positions) {
  StepOperation step;
  step.all = positions;
  return step;
}

// A vertex's body.
bool History::movable(std::uint32_t vertex) const {
  if (state_.scene.bodies.empty()) return true;
  std::size_t body = 0;
  while (vertex >= state_.scene.bodies[body].first_vertex + state_.scene.bodies[body].vertex_count) ++body;
  return !state_.fixed(body);
}

void History::change(Draws& draws, const Fault& fault) {
  if (state_.scene.bodies.empty()) return;
  const ChangeOperation change = draw_change(draws, state_);
  if (state_.scene.bodies[change.body].kind == BodyKind::kRemoved) return refuse(change, fault);
  carry(change, fault);
}

ChangeOperation History::wrong_change(Draws& draws) const {
  const auto bodies = static_cast<std::uint32_t>(state_.scene.bodies.size());
  if (bodies == 0 || draws.below(2) == 0) return {bodies + static_cast<std::uint32_t>(draws.below(3)), {}};
  ChangeOperation change = draw_change(draws, state_);
  change.as.mask = 0;
  return change;
}

AddOperation History::wrong_addition(Draws& draws) const {
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

}  // namespace warmfront::testing
