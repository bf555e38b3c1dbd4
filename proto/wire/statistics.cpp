// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/statistics.h"

#include "proto/wire/enums.h"

namespace warmfront::wire {

v1::StepStatistics to_proto(const StepStatistics& statistics) {
  v1::StepStatistics message;
  v1::StageTimes& ms = *message.mutable_ms();
  ms.set_total(statistics.ms.total);
  ms.set_refit(statistics.ms.refit);
  ms.set_front(statistics.ms.front);
  ms.set_elementary(statistics.ms.elementary);
  ms.set_adjacent(statistics.ms.adjacent);
  v1::StepCounts& counts = *message.mutable_counts();
#define WARMFRONT_SET(name) counts.set_##name(statistics.counts.name);
  WARMFRONT_STEP_COUNTS(WARMFRONT_SET)
#undef WARMFRONT_SET
  message.set_front_state(to_proto(statistics.front_state));
  message.set_bounds(to_proto(statistics.bounds));
  return message;
}

StepStatistics statistics_from(const v1::StepStatistics& message) {
  StepStatistics statistics;
  const v1::StageTimes& ms = message.ms();
  statistics.ms = {ms.total(), ms.refit(), ms.front(), ms.elementary(), ms.adjacent()};
#define WARMFRONT_GET(name) statistics.counts.name = message.counts().name();
  WARMFRONT_STEP_COUNTS(WARMFRONT_GET)
#undef WARMFRONT_GET
  statistics.front_state = known<FrontState>(message.front_state()).value_or(FrontState::kNone);
  statistics.bounds = known<BoundsKind>(message.bounds()).value_or(BoundsKind::kAuto);
  return statistics;
}

}  // namespace warmfront::wire
