// SPDX-License-Identifier: Apache-2.0
// Whether positions are as many as they must be, and finite. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "engine/frame.h"
#include "engine/result.h"
#include "engine/stop.h"
#include "engine/workers.h"

namespace warmfront {

/// kInvalidArgument unless there are 3 * vertex_count values, all finite; names the first vertex and axis
/// that is not. `what` names the field. `workers`, if any, share many values out.
template <class Real>
Status check_positions(std::span<const Real> positions, std::uint32_t vertex_count,
                       const std::string& what = "positions", StopSignal stop = {},
                       Workers* workers = nullptr);

/// The number of values alone.
Status check_count(std::size_t values, std::uint32_t vertex_count, const std::string& what = "positions");

/// Are there so many numbers that their check forks?
bool check_forks(const Positions& positions);

}  // namespace warmfront
