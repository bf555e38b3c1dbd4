// SPDX-License-Identifier: Apache-2.0
// A step's statistics on the wire. Thread-safe.
#pragma once

#include "engine/statistics.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::wire {

v1::StepStatistics to_proto(const StepStatistics& statistics);
/// Enum values added by a newer daemon become kNone or kAuto. The reason for rebuilding a front is not on the
/// wire.
StepStatistics statistics_from(const v1::StepStatistics& message);

}  // namespace warmfront::wire
