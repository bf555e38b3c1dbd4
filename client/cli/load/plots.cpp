// SPDX-License-Identifier: Apache-2.0
// Diagrams: see plots.h.
#include "client/cli/load/plots.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "client/cli/svg.h"

namespace warmfront::client::load {
namespace {

constexpr double kLeft = 60, kTop = 34, kBottom = 234, kWidth = 560;
constexpr std::size_t kColours = 8;  // classes c0 to c7

using Points = std::vector<std::pair<double, double>>;

std::string svg(double height, const std::string& title, const std::string& content) {
  return print("<svg viewBox=\"0 0 760 %.0f\" width=\"760\" height=\"%.0f\" role=\"img\">\n", height,
               height) +
         "<title>" + escaped(title) + "</title>\n" + text_at(kLeft, 16, "start", title) + content +
         "</svg>\n";
}

std::string polyline(const Points& points, std::size_t colour) {
  std::string path = print("<path class=\"line c%zu\" d=\"", colour % kColours);
  const char* command = "M";
  for (const auto& [x, y] : points) {
    path += print("%s%.1f %.1f", command, x, y);
    command = "L";
  }
  path += "\"/>\n";
  for (const auto& [x, y] : points)
    if (points.size() <= 30)
      path += print("<circle class=\"c%zu\" cx=\"%.1f\" cy=\"%.1f\" r=\"3\"/>\n", colour % kColours, x, y);
  return path;
}

std::string legend(std::size_t row, std::size_t colour, const std::string& text) {
  const double y = kTop + 8 + 15 * static_cast<double>(row);
  return print("<rect class=\"c%zu\" x=\"%.1f\" y=\"%.1f\" width=\"10\" height=\"10\"/>\n", colour % kColours,
               kLeft + kWidth + 12, y - 9) +
         text_at(kLeft + kWidth + 26, y, "start", text);
}

template <class Axis>
std::string up_marks(const Axis& axis, const std::string& unit) {
  std::string marks;
  for (const double mark : axis.marks())
    marks += line(kLeft, axis.at(mark), kLeft + kWidth, axis.at(mark)) +
             text_at(kLeft - 6, axis.at(mark) + 4, "end", print("%g", mark));
  return marks + text_at(kLeft - 6, kTop - 8, "end", unit);
}

template <class Axis>
std::string along_marks(const Axis& axis, const std::string& title) {
  std::string marks;
  for (const double mark : axis.marks())
    marks += line(axis.at(mark), kTop, axis.at(mark), kBottom) +
             text_at(axis.at(mark), kBottom + 15, "middle", print("%g", mark));
  return marks + text_at(kLeft + kWidth / 2, kBottom + 31, "middle", title);
}

std::string name_of(const Measured& m) {
  return m.plan.arrival == Arrival::kClosed ? print("%u sessions", m.plan.sessions)
                                            : print("%u at %.4g/s", m.plan.sessions, m.plan.rate);
}

}  // namespace

std::string plot_quantiles(std::span<const Point> points) {
  // Evenly spaced in nines: 0, 90%, 99%, ...
  constexpr double kNines = 4;
  std::vector<double> values;
  std::string content;
  for (const Point& point : points) {
    values.push_back(point.measured.tally.latency.quantile(0));
    values.push_back(point.measured.tally.latency.max_ms());
  }
  const LogAxis y(values, kBottom, kTop, false);
  content += up_marks(y, "ms");
  for (int nines = 0; nines <= kNines; ++nines) {
    const double x = kLeft + kWidth * nines / kNines;
    content += line(x, kTop, x, kBottom) +
               text_at(x, kBottom + 15, "middle", print("%.6g%%", 100 * (1 - std::pow(10.0, -nines))));
  }
  content += text_at(kLeft + kWidth / 2, kBottom + 31, "middle", "of frames, at most this latency");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Histogram& h = points[i].measured.tally.latency;
    Points curve;
    for (double nines = 0; nines <= kNines; nines += 0.05) {
      // Beyond one frame in all there is only the largest.
      if (h.count() == 0 || std::pow(10.0, nines) > static_cast<double>(h.count())) break;
      curve.emplace_back(kLeft + kWidth * nines / kNines, y.at(h.quantile(1 - std::pow(10.0, -nines))));
    }
    content += polyline(Points(curve), i);
    if (i < 14) content += legend(i, i, name_of(points[i].measured));
  }
  return svg(276, "latency", content);
}

std::string plot_sweep(const Report& report) {
  std::set<double> rates, sessions;
  for (const Point& point : report.points) {
    rates.insert(point.measured.plan.rate);
    sessions.insert(point.measured.plan.sessions);
  }
  const bool by_rate = rates.size() > 1 && report.points.front().measured.plan.arrival != Arrival::kClosed;
  if (!by_rate && sessions.size() < 2) return "";
  std::vector<const Measured*> order;
  for (const Point& point : report.points) order.push_back(&point.measured);
  const auto load_of = [&](const Measured& m) { return by_rate ? m.plan.rate : m.plan.sessions; };
  std::ranges::stable_sort(order, {}, [&](const Measured* m) { return load_of(*m); });

  std::vector<double> loads, values;
  for (const Measured* m : order) {
    loads.push_back(load_of(*m));
    values.push_back(m->tally.latency.quantile(0.5));
    values.push_back(m->tally.latency.quantile(0.999));
  }
  const LogAxis x(loads, kLeft, kLeft + kWidth, false), y(values, kBottom, kTop, false);
  std::string content =
      up_marks(y, "ms") + along_marks(x, by_rate ? "frames a second asked for" : "sessions");
  constexpr std::pair<double, const char*> kQuantiles[] = {{0.5, "p50"}, {0.99, "p99"}, {0.999, "p99.9"}};
  std::size_t colour = 0;
  for (const auto& [q, name] : kQuantiles) {
    Points curve;
    for (const Measured* m : order) curve.emplace_back(x.at(load_of(*m)), y.at(m->tally.latency.quantile(q)));
    content += polyline(curve, colour) + legend(colour, colour, name);
    ++colour;
  }
  if (report.knee && report.knee->rate) {
    const double at = x.at(*report.knee->rate);
    content += print("<path class=\"knee\" d=\"M%.1f %.1fL%.1f %.1f\"/>\n", at, kTop, at, kBottom) +
               legend(4, 3, print("knee: %.4g/s", *report.knee->rate)) +
               text_at(kLeft + kWidth + 26, kTop + 83, "start", report.knee->limit);
  }
  return svg(276, "latency against load", content);
}

std::string plot_split(std::span<const Point> points) {
  double most = 0;
  for (const Point& point : points) most = std::max(most, point.measured.tally.latency.mean_ms());
  if (most <= 0) return "";
  const double height = 22 * static_cast<double>(points.size());
  const LinearAxis x(most, kLeft + 70, kLeft + kWidth);
  std::string content;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double top = kTop + 22 * static_cast<double>(i);
    double sum = 0;
    content += text_at(kLeft + 64, top + 13, "end", name_of(points[i].measured));
    for (std::size_t p = 0; p < kParts; ++p) {
      const double mean = points[i].measured.tally.parts[p].mean_ms();
      content += print("<rect class=\"p%zu\" x=\"%.2f\" y=\"%.1f\" width=\"%.2f\" height=\"17\"><title>", p,
                       x.at(sum), top, std::max(0.0, x.at(sum + mean) - x.at(sum))) +
                 escaped(print("%s: %.3f ms", kPartNames[p], mean)) + "</title></rect>\n";
      sum += mean;
    }
  }
  for (const double mark : x.marks())
    content += line(x.at(mark), kTop, x.at(mark), kTop + height) +
               text_at(x.at(mark), kTop + height + 15, "middle", print("%g ms", mark));
  for (std::size_t p = 0; p < kParts; ++p) {
    const double at = kTop + 8 + 15 * static_cast<double>(p);
    content += print("<rect class=\"p%zu\" x=\"%.1f\" y=\"%.1f\" width=\"10\" height=\"10\"/>\n", p,
                     kLeft + kWidth + 12, at - 9) +
               text_at(kLeft + kWidth + 26, at, "start", kPartNames[p]);
  }
  return svg(std::max(kTop + height + 30, 200.0), "where the mean latency goes", content);
}

std::string plot_series(const Measured& measured) {
  double frames = 0, ms = 0, end = 0;
  for (const Second& second : measured.series) {
    frames = std::max(frames, static_cast<double>(second.frames) / second.seconds);
    ms = std::max(ms, second.p99_ms);
    end = std::max(end, second.at);
  }
  if (frames <= 0 || ms <= 0 || end <= 0) return "";
  const LinearAxis x(end, kLeft, kLeft + kWidth), left(frames, kBottom, kTop), right(ms, kBottom, kTop);
  std::string content = up_marks(left, "/s") + along_marks(x, "seconds from the start");
  Points rates, p99s;
  for (const Second& second : measured.series) {
    rates.emplace_back(x.at(second.at), left.at(static_cast<double>(second.frames) / second.seconds));
    p99s.emplace_back(x.at(second.at), right.at(second.p99_ms));
  }
  for (const double mark : right.marks())
    content += text_at(kLeft + kWidth + 6, right.at(mark) + 4, "start", print("%g ms", mark));
  content += polyline(rates, 0) + polyline(p99s, 1);
  const double from = x.at(std::min(measured.plan.measured_from(), end));
  content += print("<path class=\"knee\" d=\"M%.1f %.1fL%.1f %.1f\"/>\n", from, kTop, from, kBottom);
  content += print("<rect class=\"c0\" x=\"%.1f\" y=\"7\" width=\"10\" height=\"10\"/>", kLeft + 300) +
             text_at(kLeft + 314, 16, "start", "frames a second") +
             print("<rect class=\"c1\" x=\"%.1f\" y=\"7\" width=\"10\" height=\"10\"/>", kLeft + 420) +
             text_at(kLeft + 434, 16, "start", "p99 (right)");
  return svg(276, name_of(measured) + ", by time", content);
}

}  // namespace warmfront::client::load
