// SPDX-License-Identifier: Apache-2.0
// The report as one page, which follows the reader's light or dark theme: see report.h.
#include "client/cli/bench/machine.h"
#include "client/cli/load/plots.h"
#include "client/cli/load/report.h"
#include "client/cli/svg.h"

namespace warmfront::client::load {
namespace {

constexpr const char* kReportStyle = R"(<style>
:root{color-scheme:light dark}
body{font:14px/1.5 sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;color:#222;background:#fff}
h1{font-size:1.4rem}h2{font-size:1.1rem;margin-top:2rem}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.5rem 0}
td,th{padding:.2rem .55rem;text-align:right;border-bottom:1px solid #8884}
td:first-child,th:first-child{text-align:left}
td:first-child{white-space:nowrap}
.wide{overflow-x:auto;font-size:12px}
.missed{color:#c53030;font-weight:bold}.kept{color:#2f855a}
svg{max-width:100%;height:auto;display:block;margin:1rem 0}
svg text{font:11px sans-serif;fill:#333}
path{stroke:#888;stroke-opacity:.3;fill:none}
.line{stroke-width:1.8;stroke-opacity:1}
.knee{stroke:#c53030;stroke-opacity:.9;stroke-dasharray:4 3}
.c0{stroke:#2b6cb0;fill:#2b6cb0}.c1{stroke:#d9730d;fill:#d9730d}.c2{stroke:#2f855a;fill:#2f855a}
.c3{stroke:#c53030;fill:#c53030}.c4{stroke:#6b46c1;fill:#6b46c1}.c5{stroke:#0987a0;fill:#0987a0}
.c6{stroke:#975a16;fill:#975a16}.c7{stroke:#718096;fill:#718096}.line{fill:none}
.p0{fill:#c53030}.p1{fill:#cbd5e0}.p2{fill:#718096}.p3{fill:#d9730d}.p4{fill:#90cdf4}.p5{fill:#3182ce}
.p6{fill:#2f855a}.p7{fill:#9ae6b4}.p8{fill:#b794f4}.p9{fill:#ecc94b}
@media(prefers-color-scheme:dark){body{color:#ddd;background:#1a1a1a}svg text{fill:#ddd}}
</style>
)";

std::string cell(const std::string& text, const char* tag = "td") {
  return std::string("<") + tag + ">" + escaped(text) + "</" + tag + ">";
}

template <class... Texts>
std::string row(const char* tag, const Texts&... texts) {
  return "<tr>" + (cell(texts, tag) + ...) + "</tr>\n";
}

std::string number(double value) {
  return print(value < 10 ? "%.2f" : value < 100 ? "%.1f" : "%.0f", value);
}
std::string number(std::uint64_t value) {
  return std::to_string(value);
}

std::string points_table(const Report& report) {
  std::string table =
      "<div class=\"wide\"><table>\n" +
      row("th", std::string("load"), std::string("sessions"), std::string("frames/s"),
          std::string("contacts/s"), std::string("MB/s out"), std::string("in"), std::string("p50 ms"),
          std::string("p90"), std::string("p99"), std::string("p99.9"), std::string("max"),
          std::string("unsent"), std::string("errors"), std::string("reconnects"), std::string("rebuilds"));
  for (const Point& point : report.points) {
    const Measured& m = point.measured;
    const Histogram& h = m.tally.latency;
    const auto rate = [&m](std::uint64_t bytes) {
      return number(m.seconds > 0 ? 1e-6 * static_cast<double>(bytes) / m.seconds : 0.0);
    };
    table +=
        row("td", model_of(m.plan), std::to_string(m.plan.sessions), print("%.1f", m.frames_per_second()),
            print("%.0f", m.contacts_per_second()), rate(m.tally.sent_bytes), rate(m.tally.received_bytes),
            number(h.quantile(0.5)), number(h.quantile(0.9)), number(h.quantile(0.99)),
            number(h.quantile(0.999)), number(h.max_ms()), number(m.tally.unsent),
            number(m.tally.error_count()), number(m.tally.reconnects), number(m.tally.rebuilds));
  }
  return table + "</table></div>\n";
}

std::string split_table(const Measured& m) {
  std::string table =
      "<table>\n" + row("th", std::string("part of the latency"), std::string("mean ms"), std::string("p50"),
                        std::string("p90"), std::string("p99"), std::string("p99.9"), std::string("max"));
  const auto add = [&](const std::string& name, const Histogram& h) {
    table += row("td", name, print("%.3f", h.mean_ms()), number(h.quantile(0.5)), number(h.quantile(0.9)),
                 number(h.quantile(0.99)), number(h.quantile(0.999)), number(h.max_ms()));
  };
  for (std::size_t p = 0; p < kParts; ++p) add(kPartNames[p], m.tally.parts[p]);
  add("whole", m.tally.latency);
  for (std::size_t k = 0; k < kAskedKinds; ++k)
    if (!m.plan.mix.text.empty() && m.tally.latency_of[k].count() > 0)
      add(kAskedNames[k], m.tally.latency_of[k]);
  add("cold first frame", m.tally.cold);
  add("upload and build of a session", m.tally.create);
  return table + "</table>\n";
}

std::string remarks(const Point& point) {
  const Measured& m = point.measured;
  std::string text;
  for (const auto& [code, count] : m.tally.errors)
    text += "<p class=\"missed\">" + escaped(code + ": " + std::to_string(count)) + "</p>\n";
  if (const std::string outage = m.outage(); !outage.empty())
    text += "<p class=\"missed\">Warning: " + escaped(outage) + "</p>\n";
  if (const std::string limit = m.client_limit(); !limit.empty())
    text += "<p class=\"missed\">The client may be the limit: " + escaped(limit) + "</p>\n";
  if (m.tally.checked > 0)
    text += print("<p class=\"%s\">%llu answers checked, %llu differ from the engine's. ",
                  m.tally.different > 0 ? "missed" : "kept", static_cast<unsigned long long>(m.tally.checked),
                  static_cast<unsigned long long>(m.tally.different)) +
            escaped(m.tally.first_difference) + "</p>\n";
  for (const Verdict& verdict : point.verdicts)
    text += std::string("<p class=\"") + (verdict.kept ? "kept" : "missed") + "\">" +
            escaped(verdict.text()) + "</p>\n";
  return text;
}

}  // namespace

std::string format_html(const Report& report) {
  const BenchMachine machine = this_machine();
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>warmfront load: " +
      escaped(report.scene) + "</title>\n" + kReportStyle +
      "</head><body>\n<h1>warmfront load: " + escaped(report.scene) + "</h1>\n<p>" +
      escaped(print("%llu vertices, %llu triangles, %llu frames forth and back. ",
                    static_cast<unsigned long long>(report.vertices),
                    static_cast<unsigned long long>(report.triangles),
                    static_cast<unsigned long long>(report.frames)) +
              "Daemon " + report.server_version + " at " + report.server + ", " +
              std::to_string(report.server_threads) + " threads; client " + this_build().version + " on " +
              machine.cpu + ", " + std::to_string(machine.cores) + " cores.") +
      "</p>\n";
  if (!report.points.empty()) {
    const Plan& plan = report.points.front().measured.plan;
    page +=
        "<p>" +
        escaped(print("%g s measured after %g s of ramp and %g s of warm-up. Latency counts from when a "
                      "frame %s.",
                      plan.duration, plan.ramp, plan.warmup,
                      plan.arrival == Arrival::kClosed ? "is sent (closed loop)" : "is due (open loop)")) +
        "</p>\n" + points_table(report) + plot_sweep(report) + plot_quantiles(report.points) +
        plot_split(report.points);
  }
  if (report.knee)
    page += "<p><b>" +
            escaped(report.knee->rate ? print("Knee: %.6g frames a second keep ", *report.knee->rate)
                                      : "No rate tried keeps ") +
            escaped(report.knee->limit) + "</b></p>\n";
  for (const Point& point : report.points)
    page += "<h2>" + escaped(model_of(point.measured.plan)) +
            print(", %u sessions</h2>\n", point.measured.plan.sessions) + remarks(point) +
            split_table(point.measured) + plot_series(point.measured);
  return page + "</body></html>\n";
}

}  // namespace warmfront::client::load
