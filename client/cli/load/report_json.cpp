// SPDX-License-Identifier: Apache-2.0
// The report for programs and spreadsheets: see report.h. Fields are added, never renamed.
#include <nlohmann/json.hpp>

#include "client/cli/bench/machine.h"
#include "client/cli/load/report.h"
#include "client/io/text.h"

namespace warmfront::client::load {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Histogram& h) {
  return {{"count", h.count()},     {"mean", h.mean_ms()},     {"p50", h.quantile(0.5)},
          {"p90", h.quantile(0.9)}, {"p99", h.quantile(0.99)}, {"p99.9", h.quantile(0.999)},
          {"max", h.max_ms()}};
}

Json counts_of(const Measured& m) {
  const Tally& t = m.tally;
  return {{"frames", t.frames},
          {"contacts", t.contacts},
          {"frames_per_second", m.frames_per_second()},
          {"contacts_per_second", m.contacts_per_second()},
          {"sent_bytes", t.sent_bytes},
          {"received_bytes", t.received_bytes},
          {"unsent", t.unsent},
          {"errors", t.error_count()},
          {"reconnects", t.reconnects},
          {"rebuilds", t.rebuilds},
          {"capped", t.capped},
          {"all_frames", t.all_frames},
          {"all_contacts", t.all_contacts},
          {"sessions_created", t.sessions_created},
          {"checked", t.checked},
          {"different", t.different}};
}

Json plan_of(const Plan& plan) {
  const bool closed = plan.arrival == Arrival::kClosed;
  return {{"sessions", plan.sessions},
          {"arrival", to_string(plan.arrival)},
          {"rate", closed ? Json(nullptr) : Json(plan.rate)},
          {"seed", plan.arrival == Arrival::kPoisson ? Json(plan.seed) : Json(nullptr)},
          {"ramp_seconds", plan.ramp},
          {"warmup_seconds", plan.warmup},
          {"duration_seconds", plan.duration},
          {"mix", plan.mix.text.empty() ? Json(nullptr) : Json(plan.mix.text)}};
}

Json to_json(const Point& point) {
  const Measured& m = point.measured;
  Json json = plan_of(m.plan);
  json["measured_seconds"] = m.seconds;
  json["unserved_seconds"] = m.unserved_seconds;
  json["interrupted"] = m.interrupted;
  json["counts"] = counts_of(m);
  json["errors_by_code"] = Json::object();
  for (const auto& [code, count] : m.tally.errors) json["errors_by_code"][code] = count;
  Json& ms = json["ms"];
  ms["latency"] = to_json(m.tally.latency);
  ms["round_trip"] = to_json(m.tally.round_trip);
  ms["own_lateness"] = to_json(m.tally.own_late);
  ms["cold_first_frame"] = to_json(m.tally.cold);
  ms["create_session"] = to_json(m.tally.create);
  if (!m.plan.mix.text.empty()) {
    ms["questions"] = Json::object();
    for (std::size_t k = 0; k < kAskedKinds; ++k)
      if (m.tally.latency_of[k].count() > 0) ms["questions"][kAskedNames[k]] = to_json(m.tally.latency_of[k]);
  }
  for (std::size_t p = 0; p < kParts; ++p) ms["parts"][kPartNames[p]] = to_json(m.tally.parts[p]);
  json["client_cpu_cores"] = m.client_cpu_cores;
  json["client_limit"] = m.client_limit().empty() ? Json(nullptr) : Json(m.client_limit());
  json["limits"] = Json::array();
  for (const Verdict& verdict : point.verdicts)
    json["limits"].push_back(
        {{"limit", verdict.limit.text()}, {"measured", verdict.measured}, {"kept", verdict.kept}});
  json["series"] = Json::array();
  for (const Second& s : m.series)
    json["series"].push_back({{"at", s.at},
                              {"seconds", s.seconds},
                              {"frames", s.frames},
                              {"contacts", s.contacts},
                              {"errors", s.errors},
                              {"p50_ms", s.p50_ms},
                              {"p99_ms", s.p99_ms},
                              {"sessions_without_daemon", s.without_daemon},
                              {"sessions_refused", s.refused}});
  return json;
}

}  // namespace

std::string format_json(const Report& report) {
  const BenchMachine machine = this_machine();
  const BenchBuild build = this_build();
  Json json{
      {"client",
       {{"version", build.version},
        {"revision", build.revision},
        {"cpu", machine.cpu},
        {"cores", machine.cores}}},
      {"server",
       {{"address", report.server}, {"version", report.server_version}, {"threads", report.server_threads}}},
      {"scene",
       {{"name", report.scene},
        {"vertices", report.vertices},
        {"triangles", report.triangles},
        {"frames", report.frames}}}};
  add_to(json["scene"], report.model);
  json["points"] = Json::array();
  for (const Point& point : report.points) json["points"].push_back(to_json(point));
  const auto or_null = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
  };
  if (report.knee)
    json["knee"] = {{"limit", report.knee->limit},
                    {"rate", or_null(report.knee->rate)},
                    {"failed", or_null(report.knee->failed)}};
  return json.dump(1) + "\n";
}

std::string format_csv(const Report& report) {
  std::string text;
  for (const Point& point : report.points) {
    const Measured& m = point.measured;
    Json row = plan_of(m.plan);
    row["measured_seconds"] = m.seconds;
    row.update(counts_of(m));
    const auto add = [&row](const std::string& name, const Histogram& h) {
      const Json quantiles = to_json(h);
      for (const auto& item : quantiles.items())
        if (item.key() != "count") row[name + "_" + item.key() + "_ms"] = item.value();
    };
    add("latency", m.tally.latency);
    add("cold_first_frame", m.tally.cold);
    for (std::size_t k = 0; k < kAskedKinds && !m.plan.mix.text.empty(); ++k)
      add(kAskedNames[k], m.tally.latency_of[k]);
    for (std::size_t p = 0; p < kParts; ++p)
      row[std::string(kPartNames[p]) + "_mean_ms"] = m.tally.parts[p].mean_ms();
    row["client_cpu_cores"] = m.client_cpu_cores;
    row["unserved_seconds"] = m.unserved_seconds;
    std::string head, line;
    for (const auto& item : row.items()) {
      const char* separator = head.empty() ? "" : ",";
      head += separator + csv_field(item.key());
      line += separator;
      if (item.value().is_string())
        line += csv_field(item.value().get_ref<const std::string&>());
      else if (!item.value().is_null())
        line += item.value().dump();
    }
    if (text.empty()) text = head + "\n";
    text += line + "\n";
  }
  return text;
}

}  // namespace warmfront::client::load
