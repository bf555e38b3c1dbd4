// SPDX-License-Identifier: Apache-2.0
// What histories are drawn from: commands, states to begin with and options.
#pragma once

#include <rapidcheck/gtest.h>

#include <cstdint>
#include <ostream>

#include "engine/options.h"
#include "tests/support/accepted_state.h"
#include "tests/support/carry_out.h"

namespace warmfront::testing {

/// The next operation. Valid in every state, so that a history stays valid when some are removed.
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
    kJourney,  // far away, or to another size, and questions there
    kNoise,    // rounding errors, and what comes of them where commits round
    kKinds
  };
  Kind kind = kFrame;
  std::uint32_t draw = 0;
  Fault fault;
};

std::ostream& operator<<(std::ostream& out, const Command& command);
rc::Gen<Command> any_command();

/// Most are of a size near 1; some far from the origin, some very small or large.
AcceptedState draw_any_state(Draws& draws);
AcceptedState draw_any_large_state(Draws& draws);

ColliderOptions draw_options(Draws& draws, double unit);
/// Where bodies may turn, no session is of tier exact; where all may move far, all are.
ColliderOptions in_tier_of(const AcceptedState& state, ColliderOptions options);
/// Now and then one that is refused.
double draw_keep_distance(Draws& draws);

}  // namespace warmfront::testing
