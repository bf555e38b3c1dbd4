// SPDX-License-Identifier: Apache-2.0
#include "engine/statistics.h"

namespace warmfront {

std::string_view to_string(FrontState state) {
  switch (state) {
    case FrontState::kNone:
      return "none";
    case FrontState::kBuilt:
      return "built";
    case FrontState::kUpdated:
      return "updated";
    case FrontState::kRebuilt:
      return "rebuilt";
    case FrontState::kCapped:
      return "capped";
  }
  return "unknown";
}

void add(StepCounts& sum, const StepCounts& more) {
#define WARMFRONT_ADD(name) sum.name += more.name;
  WARMFRONT_STEP_COUNTS(WARMFRONT_ADD)
#undef WARMFRONT_ADD
}

}  // namespace warmfront
