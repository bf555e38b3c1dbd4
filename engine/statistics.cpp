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

double step_cost_ms(std::uint64_t elements, const StepCounts& like) {
  return 1e-6 * (50'000.0 + 60.0 * static_cast<double>(elements) + 20.0 * static_cast<double>(like.bv_tests) +
                 3.0 * static_cast<double>(like.primitive_tests) +
                 200.0 * static_cast<double>(like.elementary_tests));
}

}  // namespace warmfront
