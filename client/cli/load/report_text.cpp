// SPDX-License-Identifier: Apache-2.0
// The report for people: see report.h.

#include "client/cli/load/report.h"
#include "client/cli/markdown.h"
#include "client/cli/print.h"

namespace warmfront::client::load {
namespace {

std::string ms(double value) {
  return print(value < 10 ? "%.2f" : value < 100 ? "%.1f" : "%.0f", value);
}

Cells quantiles(const Histogram& h) {
  return {ms(h.quantile(0.5)), ms(h.quantile(0.9)), ms(h.quantile(0.99)), ms(h.quantile(0.999)),
          ms(h.max_ms())};
}

void append(Cells& cells, const Cells& more) {
  cells.insert(cells.end(), more.begin(), more.end());
}

std::string megabytes(std::uint64_t bytes, double seconds) {
  return print("%.2f", seconds > 0 ? 1e-6 * static_cast<double>(bytes) / seconds : 0);
}

std::string points_table(const Report& report) {
  std::vector<Cells> rows{{"load", "sessions", "frames/s", "contacts/s", "MB/s out", "MB/s in", "p50 ms",
                           "p90", "p99", "p99.9", "max", "unsent", "errors", "reconnects", "rebuilds"}};
  for (const Point& point : report.points) {
    const Measured& m = point.measured;
    Cells cells{model_of(m.plan),
                std::to_string(m.plan.sessions),
                print("%.1f", m.frames_per_second()),
                print("%.0f", m.contacts_per_second()),
                megabytes(m.tally.sent_bytes, m.seconds),
                megabytes(m.tally.received_bytes, m.seconds)};
    append(cells, quantiles(m.tally.latency));
    for (const std::uint64_t n :
         {m.tally.unsent, m.tally.error_count(), m.tally.reconnects, m.tally.rebuilds})
      cells.push_back(std::to_string(n));
    rows.push_back(std::move(cells));
  }
  return format_markdown_table(rows, 1);
}

std::string split_table(const Measured& m) {
  std::vector<Cells> rows{{"part of the latency", "mean ms", "share", "p50", "p90", "p99", "p99.9", "max"}};
  const auto row = [&](const char* name, const Histogram& h, bool part) {
    const double whole = m.tally.latency.sum_ms();
    Cells cells{name, print("%.3f", h.mean_ms()),
                part ? print("%.1f%%", whole > 0 ? 100 * h.sum_ms() / whole : 0) : ""};
    append(cells, quantiles(h));
    rows.push_back(std::move(cells));
  };
  for (std::size_t p = 0; p < kParts; ++p) row(kPartNames[p], m.tally.parts[p], true);
  row("whole", m.tally.latency, true);
  row("cold first frame", m.tally.cold, false);
  row("upload and build", m.tally.create, false);
  return format_markdown_table(rows, 1);
}

std::string questions_table(const Measured& m) {
  std::vector<Cells> rows{{"question", "answers", "mean ms", "p50", "p90", "p99", "p99.9", "max"}};
  for (std::size_t k = 0; k < kAskedKinds; ++k) {
    const Histogram& h = m.tally.latency_of[k];
    if (h.count() == 0) continue;
    Cells cells{kAskedNames[k], std::to_string(h.count()), print("%.3f", h.mean_ms())};
    append(cells, quantiles(h));
    rows.push_back(std::move(cells));
  }
  return format_markdown_table(rows, 1);
}

std::string remarks(const Report& report, const Point& point) {
  const Measured& m = point.measured;
  std::string text;
  for (const auto& [code, count] : m.tally.errors)
    text += print("error %s: %llu\n", code.c_str(), static_cast<unsigned long long>(count));
  if (m.plan.arrival != Arrival::kClosed && m.kept_pace() < 0.99)
    text += print("%s: %.1f%% of the frames due were sent before the end\n",
                  m.tally.errors.empty() ? "the daemon did not keep pace" : "beside these errors",
                  100 * m.kept_pace());
  if (const std::string outage = m.outage(); !outage.empty()) text += "warning: " + outage + "\n";
  if (const std::string limit = m.client_limit(); !limit.empty())
    text += "warning: the client may be the limit: " + limit + "\n";
  if (report.checked)
    text += print("checked %llu answers: %llu differ from the engine's in this process\n",
                  static_cast<unsigned long long>(m.tally.checked),
                  static_cast<unsigned long long>(m.tally.different));
  if (!m.tally.first_difference.empty()) text += m.tally.first_difference + "\n";
  if (m.interrupted) text += print("interrupted after %.1f measured seconds\n", m.seconds);
  for (const Verdict& verdict : point.verdicts) text += verdict.text() + "\n";
  return text;
}

}  // namespace

std::string model_of(const Plan& plan) {
  if (plan.arrival == Arrival::kClosed) return "closed loop";
  return print("%s at %.6g/s", std::string(to_string(plan.arrival)).c_str(), plan.rate);
}

std::string format_text(const Report& report) {
  std::string text =
      print("%s: %llu vertices, %llu triangles, %llu frames forth and back; %s (warmfrontd %s, %u threads)\n",
            report.scene.c_str(), static_cast<unsigned long long>(report.vertices),
            static_cast<unsigned long long>(report.triangles), static_cast<unsigned long long>(report.frames),
            report.server.c_str(), report.server_version.c_str(), report.server_threads);
  if (report.points.empty()) return text;
  const Plan& plan = report.points.front().measured.plan;
  text +=
      print("%g s measured after %g s of ramp and %g s of warm-up; latency counts from when a frame %s\n\n",
            plan.duration, plan.ramp, plan.warmup, plan.arrival == Arrival::kClosed ? "is sent" : "is due");
  if (!plan.mix.text.empty())
    text += "each session asks " + plan.mix.text + " in turn; a question counts as a frame\n\n";
  text += points_table(report);
  for (const Point& point : report.points) {
    if (report.points.size() > 1)
      text +=
          print("\n%s, %u sessions:\n", model_of(point.measured.plan).c_str(), point.measured.plan.sessions);
    if (!point.measured.plan.mix.text.empty()) text += "\n" + questions_table(point.measured);
    text += "\n" + split_table(point.measured);
    if (const std::string more = remarks(report, point); !more.empty()) text += "\n" + more;
  }
  if (!report.knee) return text;
  if (!report.knee->rate) return text + "\nno knee: no rate tried kept " + report.knee->limit + "\n";
  text += print("\nknee: %.6g frames a second keep ", *report.knee->rate) + report.knee->limit;
  if (report.knee->failed) text += print("; %.6g do not", *report.knee->failed);
  return text + "\n";
}

}  // namespace warmfront::client::load
