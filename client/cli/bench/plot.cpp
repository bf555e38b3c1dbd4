// SPDX-License-Identifier: Apache-2.0
// Measurements as a diagram: see bench_report.h. Plain SVG in the style of the other plots; follows the
// reader's light or dark theme.
#include <algorithm>
#include <array>

#include "client/cli/bench/report.h"
#include "client/cli/print.h"
#include "client/cli/svg.h"

namespace warmfront::client {
namespace {

struct Stage {
  const char* name;  // also the class of its colour
  Spread StageSpreads::*spread;
};
constexpr std::array<Stage, 4> kStages{{{"refit", &StageSpreads::refit},
                                        {"front", &StageSpreads::front},
                                        {"elementary", &StageSpreads::elementary},
                                        {"adjacent", &StageSpreads::adjacent}}};

constexpr double kLeft = 150, kRight = 690, kTop = 58, kRow = 24, kBar = 14;

// Stages have the colours that they have in the page of `detect --html` (html/style.css).
constexpr const char* kTimesStyle = R"(<style>
text{font:11px sans-serif;fill:#333}
path{stroke:#888;stroke-opacity:.35;fill:none}
.spread{stroke:#333;stroke-opacity:1}
.refit{fill:#2b6cb0}
.front{fill:#2f855a}
.elementary{fill:#d9730d}
.adjacent{fill:#805ad5}
@media(prefers-color-scheme:dark){text{fill:#ddd}.spread{stroke:#ddd}.refit{fill:#63b3ed}.front{fill:#68d391}
.elementary{fill:#f6ad55}.adjacent{fill:#b794f4}}
</style>
)";

std::string box(const char* style, double x, double y, double width, double height) {
  return print("<rect class=\"%s\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n", style, x, y,
               width, height);
}

/// One setting: its stages side by side, the step's total time as a number, and its spread over rounds.
std::string bar(const BenchRow& row, const LinearAxis& x, double y) {
  const double middle = y + kBar / 2;
  std::string svg =
      text_at(kLeft - 8, middle + 4, "end",
              row.setting.name + ", " + counted(static_cast<std::uint64_t>(row.setting.threads), "thread"));
  double from = 0;
  for (const Stage& stage : kStages) {
    const double ms = (row.frame.*stage.spread).median;
    svg += box(stage.name, x.at(from), y, x.at(from + ms) - x.at(from), kBar);
    from += ms;
  }
  const Spread& call = row.frame.call;
  svg += print("<path class=\"spread\" d=\"M%.1f %.1fH%.1fM%.1f %.1fv6M%.1f %.1fv6\"/>\n", x.at(call.min),
               middle, x.at(call.max), x.at(call.min), middle - 3, x.at(call.max), middle - 3);
  return svg + text_at(x.at(std::max(from, call.max)) + 6, middle + 4, "start", print("%.3g", call.median));
}

}  // namespace

std::string format_bench_svg(const BenchReport& report) {
  const double bottom = kTop + kRow * static_cast<double>(report.rows.size());
  double most = 0;
  for (const BenchRow& row : report.rows) most = std::max({most, row.frame.call.max, row.frame.total.max});
  const LinearAxis x(most > 0 ? most : 1, kLeft, kRight);
  std::string svg = print(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 %.0f\" width=\"760\" height=\"%.0f\" "
      "role=\"img\">\n",
      bottom + 40, bottom + 40);
  svg += "<title>" + escaped(report.input) + ": milliseconds a frame, by setting</title>\n" + kTimesStyle;
  svg += text_at(kLeft, 20, "start",
                 report.input + print(": %llu triangles", static_cast<unsigned long long>(report.triangles)));
  double left = kLeft;
  for (const Stage& stage : kStages) {
    svg += box(stage.name, left, 31, 10, 10) + text_at(left + 14, 40, "start", stage.name);
    left += 90;
  }
  svg += text_at(left, 40, "start", "whiskers: least and most of the rounds");
  for (const double mark : x.marks())
    svg += line(x.at(mark), kTop - 6, x.at(mark), bottom) +
           text_at(x.at(mark), bottom + 15, "middle", print("%g", mark));
  svg += text_at((kLeft + kRight) / 2, bottom + 31, "middle", "ms a frame, medians of the rounds");
  double y = kTop;
  for (const BenchRow& row : report.rows) {
    svg += bar(row, x, y);
    y += kRow;
  }
  return svg + "</svg>\n";
}

}  // namespace warmfront::client
