// SPDX-License-Identifier: Apache-2.0
#include "server/session/step_forecast.h"

#include <algorithm>

namespace warmfront::server {

// Only what follows a step is foreseen to be brief: the first of a changed scene, or of one whose warmth is
// gone, may take long, and so may the frame again that was given up. A check takes a time of its own.
void StepForecast::took(double ms, std::uint64_t elements, bool check_is_due) {
  next_ms_ = step_cost_ms(elements, counts_);
  if (beside_) next_ms_ += step_cost_ms(elements, *beside_);
  // A request that took many times what was foreseen, and more than waiting for others explains, was one of
  // the long ones, whatever counts it has to show: a step that was given up has none.
  constexpr double kOutgrown = 10, kLeastMs = 100;
  const bool outgrown = ms > std::max(kLeastMs, kOutgrown * next_ms_);
  if (outgrown) next_ms_ = ms;
  is_foreseen_ = stepped_ && !outgrown && !check_is_due;
}

}  // namespace warmfront::server
