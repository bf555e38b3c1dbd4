// SPDX-License-Identifier: Apache-2.0
// Replaced elements and bodies, drawn and applied to the model of a collider's state in the simplest way: the
// scene is taken apart into bodies and put together again. Pure functions but for what they draw.
#pragma once

#include <optional>

#include "tests/support/accepted_state.h"

namespace warmfront::testing {

/// Applies a valid change.
void accept_replacement(AcceptedState& state, const ReplaceElements& change);
void accept_replacement(AcceptedState& state, const ReplaceBody& change);

/// Some valid changes as one operation, of which most replace something; removed bodies come back, and leave
/// without a vertex.
ChangesOperation draw_replacements(Draws& draws, const AcceptedState& state);
/// One that replaces something, where one was drawn.
std::optional<SceneChange> draw_replacement(Draws& draws, const AcceptedState& state);
/// Some changes with one error, for which they must be refused as invalid.
ChangesOperation draw_wrong_replacements(Draws& draws, const AcceptedState& state);

}  // namespace warmfront::testing
