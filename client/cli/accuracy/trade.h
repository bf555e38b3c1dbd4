// SPDX-License-Identifier: Apache-2.0
// Speed against accuracy: the answers of a setting of the engine on a query set or a scene, their errors, and
// their cost. Plain values and functions that measure; one thread at a time calls them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/frames/frame_steps.h"
#include "client/cli/queries/query_run.h"
#include "client/io/input.h"
#include "client/io/truth_file.h"
#include "engine/options.h"
#include "engine/workers.h"

namespace warmfront::client {

/// Precision of the positions that reach the engine.
enum class PositionType : std::uint8_t { kFloat64, kFloat32 };
std::string_view to_string(PositionType type);

struct TradeSetting {
  Tier tier = Tier::kCertified;
  double tolerance = 1e-6;  ///< certified tier
  PositionType positions = PositionType::kFloat64;
  BoundsKind bounds = BoundsKind::kKDop18;  ///< scenes
  double separation = 0;                    ///< tiers certified and exact; the same of all that are compared

  /// "certified 1e-06", "exact", ...
  std::string name() const;
};

/// Errors of a setting's times of contact, over the contacts that both it and the truth have.
struct ToiErrors {
  std::uint64_t compared = 0;
  std::uint64_t late = 0;  ///< later than the largest double not above the exact first time
  double sum = 0;
  double max = 0;

  void add(double toi, double exact);
  double mean() const { return compared == 0 ? 0 : sum / static_cast<double>(compared); }
};

/// One line of the table.
struct TradeRow {
  std::string set{};
  bool scene = false;
  TradeSetting setting{};
  QueryTally tally{};  ///< scenes: `queries` is the feature pairs given to the elementary tests
  ToiErrors toi{};
  Times ns{};           ///< a query; scenes: the mean only
  double ms_frame = 0;  ///< scenes only
};

/// `done` of `total`.
using TradeProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Runs queries with known answers under all settings (bounds have no effect, so of settings that differ only
/// in bounds the first is run). False answers are judged by the files' truth, which is touching, or with a
/// separation by the exact tier; times by the exact tier on the original queries. Float32: the nearest float,
/// and the largest for values beyond.
std::vector<TradeRow> measure_queries(const std::string& name, std::span<const TypedQuery> queries,
                                      std::span<const TradeSetting> settings, std::uint32_t rounds,
                                      const TradeProgress& progress);

/// Comparison of the exact tier's contacts of one step with known answers.
struct KnownComparison {
  std::uint64_t known = 0;         ///< pairs known to touch
  std::uint64_t missing = 0;       ///< of these, not among the contacts
  std::uint64_t contradicted = 0;  ///< contacts of pairs known to be apart
  std::uint64_t beyond = 0;        ///< contacts of unknown pairs
  bool agrees() const { return missing == 0 && contradicted == 0; }
};

struct SceneTrade {
  std::vector<TradeRow> rows;
  std::optional<KnownComparison> comparison;
};

/// The steps of an input under all settings, `rounds` times, in turn; ms_frame is the median of the rounds'
/// means. The truth is the exact tier's contacts on the original positions; those of the first step are
/// compared with `known` (pairs that touch), unless null. For a float32 input float32 settings are skipped:
/// they would be the same.
Result<SceneTrade> measure_scene(const std::string& name, Input& input, FrameRange range,
                                 std::uint32_t substeps, std::span<const TradeSetting> settings,
                                 std::uint32_t rounds, std::shared_ptr<Workers> workers,
                                 const KnownPairs* known, const TradeProgress& progress);

/// The table for people, the lines of the CSV file (with its header), and the JSON array.
std::string format_trade_table(std::span<const TradeRow> rows);
std::string format_trade_csv(std::span<const TradeRow> rows);
std::string format_trade_json(std::span<const TradeRow> rows);

/// A plot of one set's rows: wrong answers, and the largest error in time, against cost; one point a setting.
std::string format_trade_svg(std::span<const TradeRow> rows);

}  // namespace warmfront::client
