// SPDX-License-Identifier: Apache-2.0
// What motion along lines loses where rigid bodies turn: the contacts of the same poses along lines and along
// screws. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/io/input.h"
#include "engine/result.h"
#include "engine/workers.h"

namespace warmfront::client {

/// Of one step in which each rigid body turns by the angle.
struct TurnRow {
  std::string set;
  double degrees = 0;
  std::uint64_t on_screws = 0;  ///< pairs in contact
  std::uint64_t on_lines = 0;
  std::uint64_t missed = 0;    ///< on screws alone
  std::uint64_t invented = 0;  ///< on lines alone
  double ms_screws = 0;        ///< of the step, the median of all rounds
  double ms_lines = 0;
};

/// Each rigid body of the scene, where frame `frame` has it, turns about an axis of its own through the
/// middle of its vertices, drawn from its number, by each of the angles (degrees, above 0 and below 180) in
/// turn; what else there is rests. In tier certified, with the separation. kInvalidArgument without a rigid
/// body.
Result<std::vector<TurnRow>> measure_turns(const std::string& name, Input& input, std::uint32_t frame,
                                           std::span<const double> degrees, double min_separation,
                                           std::uint32_t rounds, const std::shared_ptr<Workers>& workers);

std::string format_turns_table(std::span<const TurnRow> rows);
std::string format_turns_csv(std::span<const TurnRow> rows);
std::string format_turns_json(std::span<const TurnRow> rows);

}  // namespace warmfront::client
