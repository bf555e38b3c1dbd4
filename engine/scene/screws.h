// SPDX-License-Identifier: Apache-2.0
// Which questions go with bodies that move along screws. Pure functions.
#pragma once

#include "engine/options.h"
#include "engine/result.h"

namespace warmfront {

/// kInvalidArgument in tier exact for a scene of which a body moves along a screw: its coordinates are no
/// polynomials of time, which that tier decides. Questions of one instant go with all.
inline Status check_screws(bool any, const ColliderOptions& options) {
  if (!any || options.tier != Tier::kExact || options.pair_test != PairTest::kMotion) return {};
  return invalid_argument(
      "tier: \"exact\" decides motions along lines, and a body moves along a screw; use tier \"certified\", "
      "or "
      "give the body without its screw");
}

}  // namespace warmfront
