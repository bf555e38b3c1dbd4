// SPDX-License-Identifier: Apache-2.0
// The measured trade as a plot: see trade.h. Plain SVG, which follows the reader's light or dark theme.
#include <algorithm>
#include <cmath>

#include "client/cli/accuracy/trade.h"
#include "client/cli/svg.h"

namespace warmfront::client {
namespace {

const char* style_of(const TradeSetting& setting) {
  if (setting.tier == Tier::kFast) return "fast";
  return setting.tier == Tier::kExact ? "exact" : "certified";
}

/// Round for 18-DOPs and queries, square for AABBs; hollow for float32.
std::string marker(const TradeSetting& setting, double x, double y) {
  const std::string style =
      std::string(style_of(setting)) + (setting.positions == PositionType::kFloat32 ? " hollow" : "");
  if (setting.bounds == BoundsKind::kAabb)
    return print("<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"8\" height=\"8\"/>\n", style.c_str(),
                 x - 4, y - 4);
  return print("<circle class=\"%s\" cx=\"%.1f\" cy=\"%.1f\" r=\"4.5\"/>\n", style.c_str(), x, y);
}

std::string label_of(const TradeSetting& setting) {
  return setting.tier == Tier::kCertified ? print("%g", setting.tolerance)
                                          : std::string(to_string(setting.tier));
}

/// One diagram of `value` against `cost`, its frame's left edge at `left`.
std::string panel(std::span<const TradeRow> rows, double left, const std::string& title,
                  const std::string& cost_title, double (*cost)(const TradeRow&),
                  double (*value)(const TradeRow&)) {
  constexpr double kWidth = 300, kTop = 52, kBottom = 262;
  std::vector<double> costs, values;
  for (const TradeRow& row : rows) {
    costs.push_back(cost(row));
    values.push_back(value(row));
  }
  const LogAxis x(costs, left, left + kWidth, false);
  const LogAxis y(values, kBottom, kTop, true);
  std::string svg = text_at(left, kTop - 12, "start", title);
  for (const double mark : x.marks()) {
    svg += line(x.at(mark), kTop, x.at(mark), kBottom) +
           text_at(x.at(mark), kBottom + 15, "middle", print("%g", mark));
  }
  svg += text_at(left + kWidth / 2, kBottom + 31, "middle", cost_title);
  svg += line(left, kBottom, left + kWidth, kBottom) + text_at(left - 6, kBottom + 4, "end", "0");
  for (const double mark : y.marks()) {
    svg += line(left, y.at(mark), left + kWidth, y.at(mark)) +
           text_at(left - 6, y.at(mark) + 4, "end", print("%g", mark));
  }
  std::vector<std::pair<double, double>> labels;
  for (const TradeRow& row : rows) {
    const double px = x.at(cost(row));
    const double py = y.at(value(row));
    svg += marker(row.setting, px, py);
    // Each label only once.
    const bool taken = std::ranges::any_of(labels, [&](const auto& at) {
      return std::fabs(at.first - px) < 34 && std::fabs(at.second - py) < 11;
    });
    if (taken || row.setting.positions == PositionType::kFloat32) continue;
    labels.emplace_back(px, py);
    svg += text_at(px, py - 8, "middle", label_of(row.setting));
  }
  return svg;
}

constexpr const char* kTradeStyle = R"(<style>
text{font:11px sans-serif;fill:#333}
path{stroke:#888;stroke-opacity:.35}
circle,rect{stroke-width:1.5}
.fast{fill:#d9730d;stroke:#d9730d}
.certified{fill:#2b6cb0;stroke:#2b6cb0}
.exact{fill:#2f855a;stroke:#2f855a}
.hollow{fill:none}
@media(prefers-color-scheme:dark){text{fill:#ddd}.certified{fill:#63b3ed;stroke:#63b3ed}.exact{fill:#68d391;stroke:#68d391}
.fast{fill:#f6ad55;stroke:#f6ad55}.hollow{fill:none}}
</style>
)";

}  // namespace

std::string format_trade_svg(std::span<const TradeRow> rows) {
  if (rows.empty()) return "";
  const bool scene = rows.front().scene;
  const std::string cost_title = scene ? "ms a frame" : "ns a query, mean";
  double (*const cost)(const TradeRow&) =
      scene ? [](const TradeRow& r) { return r.ms_frame; } : [](const TradeRow& r) { return r.ns.mean; };
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 330\" width=\"760\" height=\"330\" "
      "role=\"img\">\n";
  svg += "<title>" + escaped(rows.front().set) + ": accuracy against cost</title>\n" + kTradeStyle;
  svg += text_at(52, 20, "start", rows.front().set);
  svg += panel(rows, 52, "wrong answers (false positives + false negatives)", cost_title, cost,
               [](const TradeRow& r) {
                 return static_cast<double>(r.tally.false_positives + r.tally.false_negatives);
               });
  svg +=
      panel(rows, 432, "largest error of toi", cost_title, cost, [](const TradeRow& r) { return r.toi.max; });
  double left = 52;
  const auto legend = [&](const TradeSetting& setting, const char* text, double width) {
    svg += marker(setting, left + 5, 314) + text_at(left + 14, 318, "start", text);
    left += width;
  };
  legend({.tier = Tier::kFast}, "fast", 60);
  legend({.tier = Tier::kCertified}, "certified, at its tolerance", 170);
  legend({.tier = Tier::kExact}, "exact", 70);
  legend({.tier = Tier::kExact, .positions = PositionType::kFloat32}, "hollow: positions in float32", 180);
  if (scene)
    legend({.tier = Tier::kExact, .bounds = BoundsKind::kAabb}, "square: AABBs, round: 18-DOPs", 180);
  return svg + "</svg>\n";
}

}  // namespace warmfront::client
