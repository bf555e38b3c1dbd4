// SPDX-License-Identifier: Apache-2.0
// A report of `detect --json` as `merge` reads it. Plain values and pure functions.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "client/cli/ranges/range_report.h"
#include "engine/result.h"

namespace warmfront::client {

struct Part {
  std::string path;
  nlohmann::ordered_json report;  ///< as it was read, with the fields that are looked at there
  RangeReport range;
};

/// Reads the file. Fails, naming it, when it is no such report, or is cut short.
Result<Part> read_part(const std::string& path);

/// Sorts the parts by their frames. Fails when two of them are not of one input, ask other questions, share
/// frames, or do not meet where one follows the other; the message names both files and what to do.
Status order_parts(std::vector<Part>& parts);

/// The ranges of steps of `wanted` that no part has. Fails when a part has others.
Result<std::vector<FrameRange>> missing_ranges(std::span<const Part> parts, FrameRange wanted);

}  // namespace warmfront::client
