// SPDX-License-Identifier: Apache-2.0
// The measured trade of speed for accuracy: what one setting of the engine answers on one set of queries or
// one scene, how that differs from the truth, and what it costs. Plain values and functions that measure; one
// thread at a time calls them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/frame_steps.h"
#include "client/cli/query_run.h"
#include "client/io/input.h"
#include "client/io/truth_file.h"
#include "engine/options.h"
#include "engine/workers.h"

namespace warmfront::client {

/// In which precision positions reach the engine.
enum class PositionType : std::uint8_t { kFloat64, kFloat32 };
std::string_view to_string(PositionType type);

struct TradeSetting {
  Tier tier = Tier::kCertified;
  double tolerance = 1e-6;  ///< certified tier
  PositionType positions = PositionType::kFloat64;
  BoundsKind bounds = BoundsKind::kKDop18;  ///< scenes

  /// "certified 1e-06", "exact", ...
  std::string name() const;
};

/// What a setting's times of contact are off by, over the contacts that both it and the truth have.
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

/// Queries with known answers under all settings (bounds make no difference here, so of settings that differ
/// in them only the first is run). The files' truth decides what is false; the exact tier's time on the
/// queries as they are, what is off. Float32: the nearest float, and the largest for what is beyond.
std::vector<TradeRow> measure_queries(const std::string& name, std::span<const TypedQuery> queries,
                                      std::span<const TradeSetting> settings, std::uint32_t rounds,
                                      const TradeProgress& progress);

/// The exact tier's contacts of one step beside answers known from elsewhere.
struct KnownComparison {
  std::uint64_t known = 0;         ///< pairs known to touch
  std::uint64_t missing = 0;       ///< of these, not among the contacts
  std::uint64_t contradicted = 0;  ///< contacts known to be none
  std::uint64_t beyond = 0;        ///< contacts of which nothing is known
  bool agrees() const { return missing == 0 && contradicted == 0; }
};

struct SceneTrade {
  std::vector<TradeRow> rows;
  std::optional<KnownComparison> comparison;
};

/// The steps of an input under all settings, `rounds` times over, in turn; ms_frame is the median of the
/// rounds' means. The truth is the exact tier's contacts on the positions as they are; those of the first
/// step are compared with `known`, where it is not null. For an input that is float32 itself, float32
/// settings are left out: they would be the same.
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
