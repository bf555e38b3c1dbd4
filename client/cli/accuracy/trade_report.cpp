// SPDX-License-Identifier: Apache-2.0
// The measured trade as table, CSV and JSON: see trade.h.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "client/cli/accuracy/trade.h"
#include "client/cli/json_rows.h"
#include "client/cli/markdown.h"
#include "client/cli/print.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// A row's fields, in the order of the CSV's columns; null if not applicable.
Json to_json(const TradeRow& row) {
  const TradeSetting& setting = row.setting;
  const auto only = [](bool applies, Json value) { return applies ? std::move(value) : Json(nullptr); };
  return {{"set", row.set},
          {"kind", row.scene ? "scene" : "queries"},
          {"tier", to_string(setting.tier)},
          {"tolerance", only(setting.tier == Tier::kCertified, setting.tolerance)},
          {"positions", to_string(setting.positions)},
          {"bounds", only(row.scene, to_string(setting.bounds))},
          {"queries", row.tally.queries},
          {"contacts", row.tally.contacts},
          {"false_positives", row.tally.false_positives},
          {"false_negatives", row.tally.false_negatives},
          {"possible", row.tally.possible},
          {"toi_error_max", row.toi.max},
          {"toi_error_mean", row.toi.mean()},
          {"late", row.toi.late},
          {"ns_per_query", row.ns.mean},
          {"ns_p99", only(!row.scene, row.ns.p99)},
          {"ns_max", only(!row.scene, row.ns.max)},
          {"ms_per_frame", only(row.scene, row.ms_frame)}};
}

Cells table_head(bool scene) {
  Cells head{"setting", "positions"};
  if (scene) head.push_back("bounds");
  for (const char* name :
       {"false positives", "false negatives", "undecided", "toi error: max", "mean", "late"})
    head.push_back(name);
  for (const char* name : {"ns a query", "p99", "max"})
    if (!scene || name[0] == 'n') head.push_back(name);
  if (scene) head.push_back("ms a frame");
  return head;
}

Cells table_row(const TradeRow& row) {
  const auto count = [](std::uint64_t n) { return std::to_string(n); };
  Cells cells{row.setting.name(), std::string(to_string(row.setting.positions))};
  if (row.scene) cells.emplace_back(to_string(row.setting.bounds));
  cells.insert(cells.end(), {count(row.tally.false_positives), count(row.tally.false_negatives),
                             count(row.tally.possible), print("%.1e", row.toi.max),
                             print("%.1e", row.toi.mean()), count(row.toi.late), print("%.0f", row.ns.mean)});
  if (row.scene) {
    cells.push_back(print("%.1f", row.ms_frame));
  } else {
    cells.push_back(print("%.0f", row.ns.p99));
    cells.push_back(print("%.0f", row.ns.max));
  }
  return cells;
}

}  // namespace

std::string format_trade_table(std::span<const TradeRow> rows) {
  std::string text;
  for (auto begin = rows.begin(); begin != rows.end();) {
    const auto end = std::find_if(
        begin, rows.end(), [&](const TradeRow& r) { return r.set != begin->set || r.scene != begin->scene; });
    text += begin->set + ": ";
    if (!begin->scene) text += std::to_string(begin->tally.queries) + " queries, ";
    text += std::to_string(begin->tally.contacts) + " contacts in truth\n\n";
    std::vector<Cells> cells{table_head(begin->scene)};
    std::transform(begin, end, std::back_inserter(cells), table_row);
    text += format_markdown_table(cells, begin->scene ? 3 : 2) + (end == rows.end() ? "" : "\n");
    begin = end;
  }
  return text;
}

std::string format_trade_csv(std::span<const TradeRow> rows) {
  std::vector<Json> fields;
  for (const TradeRow& row : rows) fields.push_back(to_json(row));
  return csv_of(to_json({}), fields);
}

std::string format_trade_json(std::span<const TradeRow> rows) {
  Json json = Json::array();
  for (const TradeRow& row : rows) json.push_back(to_json(row));
  return json.dump(1) + "\n";
}

}  // namespace warmfront::client
