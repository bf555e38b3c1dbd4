// SPDX-License-Identifier: Apache-2.0
// Measurements as tables for people: see bench_report.h.
#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "client/cli/bench/report.h"
#include "client/cli/markdown.h"
#include "client/cli/print.h"
#include "engine/instructions.h"

namespace warmfront::client {
namespace {

/// Table 1 of Tang, Manocha and Tong 2009: running time on N cores in per cent of that on one.
constexpr std::array<std::pair<int, double>, 9> kPaperRunningTime{{{1, 100},
                                                                   {2, 60.55},
                                                                   {4, 37.34},
                                                                   {6, 28.46},
                                                                   {8, 24.06},
                                                                   {10, 22.73},
                                                                   {12, 21.27},
                                                                   {14, 20.04},
                                                                   {16, 18.94}}};

std::string ms(const Spread& spread) {
  return print("%.2f", spread.median);
}

std::string in_words(const BenchReport& report) {
  const ColliderOptions& o = report.rows.front().setting.options;
  std::string text = report.input + print(": %llu triangles, %llu vertices, %llu steps",
                                          static_cast<unsigned long long>(report.triangles),
                                          static_cast<unsigned long long>(report.vertices),
                                          static_cast<unsigned long long>(report.steps));
  if (report.substeps > 1) text += print(" (%u to a frame)", report.substeps);
  text += "; default: " + std::string(to_string(o.tier));
  if (o.tier == Tier::kCertified) text += print(" %g", o.tolerance);
  if (o.min_separation > 0) text += print(", separation %g", o.min_separation);
  text += ", report " + std::string(to_string(o.report)) + ", front " + std::string(to_string(o.front));
  if (o.front == FrontMode::kWarm && o.lazy_front) text += " and lazy";
  return text + ", " + std::string(to_string(o.bounds)) +
         print(", leaf %u, cones %s", o.leaf_size, o.normal_cones ? "on" : "off");
}

std::string times_table(const BenchReport& report) {
  std::vector<Cells> cells{{"ms a frame", "threads", "create", "cold step", "step", "min", "max", "refit",
                            "front", "elementary", "adjacent", "contacts", "hash"}};
  for (const BenchRow& row : report.rows) {
    const StageSpreads& frame = row.frame;
    cells.push_back({row.setting.name, std::to_string(row.setting.threads), ms(row.create), ms(row.cold),
                     ms(frame.call), print("%.2f", frame.call.min), print("%.2f", frame.call.max),
                     ms(frame.refit), ms(frame.front), ms(frame.elementary), ms(frame.adjacent),
                     print("%.0f", row.a_frame(row.contacts)), row.hash});
  }
  return format_markdown_table(cells, 1);
}

std::string counts_table(const BenchReport& report) {
  std::vector<Cells> cells{{"counts a frame", "bv tests", "primitive tests", "front pairs", "skipped",
                            "sprouted", "pruned", "triangle pairs", "elementary tests", "coplanar", "exact",
                            "MB touched", "front B/triangle", "session MB"}};
  for (const BenchRow& row : report.rows) {
    if (&row != &report.rows.front() && row.setting.name == report.rows.front().setting.name) continue;
    const StepCounts& c = row.counts;
    const auto count = [&](std::uint64_t n) { return print("%.0f", row.a_frame(n)); };
    cells.push_back(
        {row.setting.name, count(c.bv_tests), count(c.primitive_tests), count(c.front_pairs),
         count(c.front_skipped), count(c.front_sprouted), count(c.front_pruned), count(c.triangle_pairs),
         count(c.elementary_tests), count(c.coplanarity_passed), count(c.exact_tests),
         print("%.1f", bytes_touched(report, row) / 1e6),
         print("%.0f", static_cast<double>(row.front_bytes) / static_cast<double>(report.triangles)),
         print("%.1f", static_cast<double>(row.memory_bytes) / 1e6)});
  }
  return format_markdown_table(cells, 1);
}

/// The paper's Table 1. The stages correspond, except that bounds of triangle pairs are tested in `front`.
std::string threads_table(const BenchReport& report) {
  std::vector<Cells> cells{
      {"threads", "updating front", "non-adjacent pairs", "updating BVH", "running time", "the paper's"}};
  const BenchRow& base = report.rows.front();
  for (const BenchRow& row : report.rows) {
    if (row.setting.name != base.setting.name) continue;
    const auto share = [&](Spread StageSpreads::*stage) {
      const double whole = (base.frame.*stage).median;
      return whole > 0 ? print("%.1f%%", 100 * (row.frame.*stage).median / whole) : std::string("-");
    };
    const auto* paper =
        std::ranges::find(kPaperRunningTime, row.setting.threads, &std::pair<int, double>::first);
    const bool known = paper != kPaperRunningTime.end() && base.setting.threads == 1;
    cells.push_back({std::to_string(row.setting.threads), share(&StageSpreads::front),
                     share(&StageSpreads::elementary), share(&StageSpreads::refit),
                     share(&StageSpreads::call), known ? print("%.2f%%", paper->second) : "-"});
  }
  return cells.size() > 2 ? "\n" + format_markdown_table(cells, 0) : "";
}

/// Time outside the elementary tests and those of adjacent pairs.
double outside_elementary(const BenchRow& row) {
  return row.frame.total.median - row.frame.elementary.median - row.frame.adjacent.median;
}

std::string saved(const BenchRow& row, const BenchRow& none) {
  const auto less = [](double value, double than) { return than > 0 ? 100 * (1 - value / than) : 0.0; };
  return print("%.0f%% of bounding volume tests, %.0f%% of the time outside the elementary tests",
               less(row.a_frame(row.counts.bv_tests), none.a_frame(none.counts.bv_tests)),
               less(outside_elementary(row), outside_elementary(none)));
}

std::string savings(const BenchReport& report) {
  const BenchRow& base = report.rows.front();
  std::string text;
  const auto none =
      std::ranges::find(report.rows, "front none", [](const BenchRow& r) { return r.setting.name; });
  if (none != report.rows.end()) {
    text += "saved against front none:\n";
    for (const BenchRow& row : report.rows) {
      const bool front = row.setting.name.starts_with("front ") && &row != &*none;
      if (front || &row == &base) text += "  " + row.setting.name + ": " + saved(row, *none) + "\n";
    }
  }
  const double tests = base.frame.elementary.median + base.frame.adjacent.median;
  if (tests > 0)
    text += print("the whole step takes %.2f times its elementary tests\n", base.frame.total.median / tests);
  const std::uint64_t adjacent = base.counts.adjacent_pairs;
  const std::uint64_t pairs = adjacent + base.counts.triangle_pairs;
  if (pairs > 0) {
    text +=
        print("%.0f%% of the triangle pairs whose bounds overlap are adjacent: the orphan sets test them\n",
              100.0 * static_cast<double>(adjacent) / static_cast<double>(pairs));
  }
  return text + print("peak memory of this process so far: %.0f MB\n",
                      static_cast<double>(report.peak_rss_bytes) / 1e6);
}

}  // namespace

std::string format_bench_context(const BenchContext& context) {
  const BenchMachine& machine = context.machine;
  const BenchBuild& build = context.build;
  const std::string slow = why_instructions_are_slow();
  return "machine: " + machine.cpu +
         print(", %d cores, %.1f GB\n", machine.cores, static_cast<double>(machine.memory_bytes) / 1e9) +
         "build: warmfront " + (build.revision.empty() ? build.version : build.revision) + ", " +
         build.compiler + ", " + build.type + (build.flags.empty() ? "" : " " + build.flags) +
         ", hot loops for " + build.instructions +
         (context.rounds > 0 ? print("; medians of %u rounds\n", context.rounds) : "\n") +
         (slow.empty() ? "" : "slow: " + slow + "\n");
}

std::string format_bench_tables(const BenchReport& report) {
  return in_words(report) + "\n\n" + times_table(report) + "\n" + counts_table(report) +
         threads_table(report) + "\n" + savings(report);
}

}  // namespace warmfront::client
