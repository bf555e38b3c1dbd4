// SPDX-License-Identifier: Apache-2.0
// The cost of the engine's settings on an input's frames: the measurements of `warmfront bench`. Plain
// values, and functions for one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/frames/frame_steps.h"
#include "client/io/input.h"
#include "engine/options.h"
#include "engine/result.h"
#include "engine/statistics.h"

namespace warmfront::client {

struct BenchSetting {
  std::string name;  ///< "default", or the difference from it: "front none", "leaf 1", ...
  ColliderOptions options;
  int threads = 1;
};

/// Settings to measure besides the default.
struct Ablations {
  bool front = false;   ///< none, paper, warm, warm and lazy
  bool cones = false;   ///< normal cones on, off
  bool bounds = false;  ///< AABB, 18-DOP
  bool found = false;   ///< bodies and rigid motion are not found
  bool leaf = false;    ///< 1, 2, 4, 8 triangles
  bool tier = false;    ///< fast, certified, exact
};

/// `base` with each number of threads, then its ablations with the first number; without those equal to
/// `base` and tiers that do not support its separation.
std::vector<BenchSetting> bench_settings(const ColliderOptions& base, std::span<const int> threads,
                                         const Ablations& ablations);

/// Median, least and largest over the rounds.
struct Spread {
  double median = 0;
  double min = 0;
  double max = 0;
};

/// Milliseconds a frame: the spread, over rounds, of the mean over frames.
struct StageSpreads {
  Spread call;                                       ///< of the call Collider::step()
  Spread total, refit, front, elementary, adjacent;  ///< as StageTimes
};

/// One line of the table. `frame` figures are of the warm frames, all but the first; an input of one step has
/// only that one, which then counts as warm.
struct BenchRow {
  BenchSetting setting;
  std::string hash;  ///< ContactHash over all frames
  Spread create;     ///< milliseconds of Collider::create()
  Spread cold;       ///< milliseconds of the first step's call: it builds the hierarchy and the front
  StageSpreads frame{};
  StepCounts counts{};             ///< of one round, all warm frames together
  std::uint64_t frames = 0;        ///< number of warm frames
  std::uint64_t contacts = 0;      ///< of the warm frames
  std::uint64_t front_bytes = 0;   ///< largest size of the front after a step
  std::uint64_t memory_bytes = 0;  ///< held by the collider, its scene and front at the end

  double a_frame(std::uint64_t count) const {
    return static_cast<double>(count) / static_cast<double>(frames);
  }
};

/// Within a tier all rows must have the same hash. A sentence that names two rows that differ; none if all
/// agree.
std::optional<std::string> disagreement(std::span<const BenchRow> rows);

struct BenchReport {
  std::string input;
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;
  std::uint64_t steps = 0;
  std::uint32_t substeps = 1;
  std::uint64_t peak_rss_bytes = 0;  ///< of the process, so far
  std::vector<BenchRow> rows;        ///< the default on its first number of threads comes first
  /// See disagreement(); or a row whose answer changed between rounds.
  std::optional<std::string> disagreement;
};

/// An estimate of the bytes that a frame's work reads and writes without caches: counts times the sizes of
/// the data handled. For comparison between settings, and with the machine's memory bandwidth; not a
/// measurement.
double bytes_touched(const BenchReport& report, const BenchRow& row);

/// Steps through the range under all settings, `rounds` times, in turn, so that a slow phase of the machine
/// affects all alike. Frames are read beforehand. Fails as reading and stepping do.
Result<BenchReport> measure_bench(
    const std::string& name, Input& input, FrameRange range, std::uint32_t substeps,
    std::span<const BenchSetting> settings, std::uint32_t rounds,
    const std::function<void(std::uint64_t done, std::uint64_t total)>& progress);

}  // namespace warmfront::client
