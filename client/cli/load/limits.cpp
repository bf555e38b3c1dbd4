// SPDX-License-Identifier: Apache-2.0
// Limits: see limits.h.
#include "client/cli/load/limits.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/cli/print.h"
#include "client/io/text.h"

namespace warmfront::client::load {

struct Limited {
  enum class Unit { kMilliseconds, kCount, kPerSecond };
  const char* name;
  Unit unit;
  double (*of)(const Measured&);
};

namespace {

using Unit = Limited::Unit;

template <int kPerMille>
double latency(const Measured& m) {
  return m.tally.latency.quantile(1e-3 * kPerMille);
}
double count(std::uint64_t n) {
  return static_cast<double>(n);
}

constexpr Limited kLimited[] = {
    {"p50", Unit::kMilliseconds, latency<500>},
    {"p90", Unit::kMilliseconds, latency<900>},
    {"p99", Unit::kMilliseconds, latency<990>},
    {"p99.9", Unit::kMilliseconds, latency<999>},
    {"max", Unit::kMilliseconds, latency<1000>},
    {"mean", Unit::kMilliseconds, [](const Measured& m) { return m.tally.latency.mean_ms(); }},
    {"cold-max", Unit::kMilliseconds, [](const Measured& m) { return m.tally.cold.max_ms(); }},
    {"late-p99", Unit::kMilliseconds, [](const Measured& m) { return m.tally.parts[kLate].quantile(0.99); }},
    {"errors", Unit::kCount, [](const Measured& m) { return count(m.tally.error_count()); }},
    {"reconnects", Unit::kCount, [](const Measured& m) { return count(m.tally.reconnects); }},
    {"rebuilds", Unit::kCount, [](const Measured& m) { return count(m.tally.rebuilds); }},
    {"different", Unit::kCount, [](const Measured& m) { return count(m.tally.different); }},
    {"unsent", Unit::kCount, [](const Measured& m) { return count(m.tally.unsent); }},
    {"frames-per-second", Unit::kPerSecond, [](const Measured& m) { return m.frames_per_second(); }},
};

const char* unit_of(const Limited& what) {
  return what.unit == Unit::kMilliseconds ? "ms" : "";
}

std::string digits_of(double value) {
  return print("%.6g", value);
}

}  // namespace

std::string limit_names() {
  std::string names;
  for (const Limited& limited : kLimited) names.append(names.empty() ? "" : ", ").append(limited.name);
  return names;
}

std::string Limit::text() const {
  return std::string(what->name) + "=" + digits_of(value) + unit_of(*what);
}

Result<Limit> parse_limit(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view name = text.substr(0, equals);
  const auto* found = std::ranges::find_if(kLimited, [&](const Limited& l) { return name == l.name; });
  if (equals == std::string_view::npos || found == std::end(kLimited))
    return invalid_argument(in_quotes(text) + ": NAME=VALUE is expected, where NAME is one of " +
                            limit_names());
  std::string_view number = text.substr(equals + 1);
  double scale = 1;
  if (found->unit == Unit::kMilliseconds) {
    if (number.ends_with("us")) {
      scale = 1e-3;
      number.remove_suffix(2);
    } else if (number.ends_with("ms")) {
      number.remove_suffix(2);
    } else if (number.ends_with("s")) {
      scale = 1e3;
      number.remove_suffix(1);
    } else {
      return invalid_argument(in_quotes(text) + ": a time needs its unit, like " + std::string(name) +
                              "=20ms");
    }
  }
  double value = 0;
  if (!parse_number(number, value) || !std::isfinite(value) || value < 0)
    return invalid_argument(in_quotes(text) + ": the value must be a number that is not negative");
  return Limit{found, scale * value};
}

std::string Verdict::text() const {
  const std::string unit = limit.what->unit == Unit::kMilliseconds ? " ms" : "";
  const std::string value = " (" + digits_of(measured) + unit + ")";
  if (kept) return "kept " + limit.text() + value;
  return "missed " + limit.text() + " by " + digits_of(std::fabs(measured - limit.value)) + unit + value;
}

Verdict judge(const Limit& limit, const Measured& measured) {
  const double value = limit.what->of(measured);
  const bool least = limit.what->unit == Unit::kPerSecond;
  const bool empty = limit.what->unit == Unit::kMilliseconds && measured.tally.frames == 0;
  return {limit, value, !empty && (least ? value >= limit.value : value <= limit.value)};
}

std::vector<Verdict> judge(std::span<const Limit> limits, const Measured& measured) {
  std::vector<Verdict> verdicts;
  for (const Limit& limit : limits) verdicts.push_back(judge(limit, measured));
  return verdicts;
}

bool all_kept(std::span<const Verdict> verdicts) {
  return std::ranges::all_of(verdicts, &Verdict::kept);
}

}  // namespace warmfront::client::load
