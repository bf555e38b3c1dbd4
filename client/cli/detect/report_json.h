// SPDX-License-Identifier: Apache-2.0
// The output of `detect --json`. Other tools read it: fields are added, never renamed. Plain values and pure
// functions.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/frames/model_summary.h"
#include "client/cli/ranges/range_report.h"
#include "engine/options.h"
#include "engine/statistics.h"

namespace warmfront::client {

/// A step, by the index of its end frame.
struct FrameReport {
  std::uint64_t frame = 0;
  std::uint64_t vf = 0;
  std::uint64_t ee = 0;
  std::uint64_t vh = 0;
  std::uint64_t possible = 0;
  std::optional<double> earliest_toi;
  StepStatistics statistics;
  std::uint64_t frame_bytes = 0;  ///< of the frame on the wire, or that it would take there
};

struct DetectReport {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t edges = 0;   ///< given besides the triangles' sides
  bool half_spaces = false;  ///< are there any?
  ColliderOptions options;
  ModelSummary model;
  int threads = 0;
  /// ContactHash over all steps, in hexadecimal; empty without contacts (`--report count`).
  std::string contacts_hash;
  RangeReport range;
  std::vector<FrameReport> frames;
};

/// The report as a JSON object, with a final line end.
std::string format_json(const DetectReport& report);

}  // namespace warmfront::client
