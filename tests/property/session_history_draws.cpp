// SPDX-License-Identifier: Apache-2.0
#include "tests/property/session_history_draws.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace warmfront::testing {

std::ostream& operator<<(std::ostream& out, const Command& command) {
  constexpr const char* kNames[] = {"frame",          "nothing moves", "glide",         "add",
                                    "change",         "place",         "self_check",    "forget",
                                    "resume",         "wrong frame",   "wrong change",  "wrong addition",
                                    "wrong place",    "outlier",       "trial",         "line search",
                                    "max_step",       "commit",        "wrong commit",  "near",
                                    "filters",        "wrong filters", "replace",       "wrong replacement",
                                    "excluded pairs", "options",       "wrong options", "journey",
                                    "noise"};
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
                                                {1, rc::gen::just(int{Command::kJourney})},
                                                {1, rc::gen::just(int{Command::kNoise})},
                                                {4, rc::gen::inRange<int>(0, Command::kKinds)}}),
                   [](int k) { return static_cast<Command::Kind>(k); });
  return rc::gen::build<Command>(
      rc::gen::set(&Command::kind, kind),
      rc::gen::set(&Command::draw, rc::gen::inRange<std::uint32_t>(0, 1U << 30)),
      rc::gen::set(&Command::fault, rc::gen::build<Fault>(rc::gen::set(&Fault::kind, fault_kind),
                                                          rc::gen::set(&Fault::n, n))));
}

namespace {

AcceptedState::Travels draw_travels(Draws& draws, bool may_turn) {
  const auto travels = static_cast<AcceptedState::Travels>(draws.below(3));
  return may_turn && travels == AcceptedState::Travels::kMoving ? AcceptedState::Travels::kPlaced : travels;
}

}  // namespace

AcceptedState draw_any_state(Draws& draws) {
  AcceptedState state = draw_state(draws);
  state.travels = draw_travels(draws, state.may_turn);
  if (draws.below(4) != 0) return state;
  return scaled(std::move(state), std::ldexp(1, draws.below(2) == 0 ? 0 : 20 * (draws.below(41) - 20)),
                draws.below(3) * 1000.0);
}

AcceptedState draw_any_large_state(Draws& draws) {
  AcceptedState state = draw_large_state(draws);
  state.travels = draw_travels(draws, state.may_turn);
  return state;
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

ColliderOptions in_tier_of(const AcceptedState& state, ColliderOptions options) {
  if (state.may_turn) options.tier = Tier::kCertified;
  if (state.travels == AcceptedState::Travels::kMoving) options.tier = Tier::kExact;
  return options;
}

double draw_keep_distance(Draws& draws) {
  if (draws.below(12) == 0)
    return std::array{0.0, 1.0, -0.5, std::numeric_limits<double>::quiet_NaN()}[draws.below(4)];
  return std::array{0.5, 0.1, 0.9, 0x1p-30, 0.999}[draws.below(5)];
}

}  // namespace warmfront::testing
