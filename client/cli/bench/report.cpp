// SPDX-License-Identifier: Apache-2.0
// Measurements as CSV and JSON: see bench_report.h.
#include "client/cli/bench/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/io/text.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Spread& spread) {
  return {{"median", spread.median}, {"min", spread.min}, {"max", spread.max}};
}

Json to_json(const BenchReport& report, const BenchRow& row) {
  const ColliderOptions& options = row.setting.options;
  const StepCounts& counts = row.counts;
  const auto a_frame = [&](std::uint64_t count) { return row.a_frame(count); };
  const Json tolerance = options.tier == Tier::kCertified ? Json(options.tolerance) : Json(nullptr);
  return {
      {"setting", row.setting.name},
      {"threads", row.setting.threads},
      {"tier", to_string(options.tier)},
      {"tolerance", tolerance},
      {"min_separation", options.min_separation},
      {"report", to_string(options.report)},
      {"front", to_string(options.front)},
      {"lazy", options.front == FrontMode::kWarm && options.lazy_front},
      {"bounds", to_string(options.bounds)},
      {"normal_cones", options.normal_cones},
      {"leaf_size", options.leaf_size},
      {"hash", row.hash},
      {"ms",
       {{"create", to_json(row.create)},
        {"cold", to_json(row.cold)},
        {"step", to_json(row.frame.call)},
        {"total", to_json(row.frame.total)},
        {"refit", to_json(row.frame.refit)},
        {"front", to_json(row.frame.front)},
        {"elementary", to_json(row.frame.elementary)},
        {"adjacent", to_json(row.frame.adjacent)}}},
      {"counts",
       {{"contacts", a_frame(row.contacts)},
        {"bv_tests", a_frame(counts.bv_tests)},
        {"primitive_tests", a_frame(counts.primitive_tests)},
        {"front_pairs", a_frame(counts.front_pairs)},
        {"front_skipped", a_frame(counts.front_skipped)},
        {"front_sprouted", a_frame(counts.front_sprouted)},
        {"front_pruned", a_frame(counts.front_pruned)},
        {"triangle_pairs", a_frame(counts.triangle_pairs)},
        {"adjacent_pairs", a_frame(counts.adjacent_pairs)},
        {"cone_culled_pairs", a_frame(counts.cone_culled_pairs)},
        {"orphan_tests", a_frame(counts.orphan_tests)},
        {"elementary_tests", a_frame(counts.elementary_tests)},
        {"coplanarity_passed", a_frame(counts.coplanarity_passed)},
        {"exact_tests", a_frame(counts.exact_tests)}}},
      {"bytes",
       {{"touched", bytes_touched(report, row)},
        {"front", row.front_bytes},
        {"front_per_triangle", static_cast<double>(row.front_bytes) / static_cast<double>(report.triangles)},
        {"session", row.memory_bytes}}}};
}

Json head_of(const BenchReport& report) {
  return {{"input", report.input},        {"triangles", report.triangles},
          {"vertices", report.vertices},  {"steps", report.steps},
          {"substeps", report.substeps},  {"peak_rss_bytes", report.peak_rss_bytes},
          {"agree", !report.disagreement}};
}

/// A line's fields with their names, nested ones as "ms_total_median".
std::vector<std::pair<std::string, std::string>> csv_fields(const BenchReport& report, const BenchRow& row) {
  Json line = head_of(report);
  line.update(to_json(report, row));
  std::vector<std::pair<std::string, std::string>> fields;
  const Json flat = line.flatten();
  for (const auto& item : flat.items()) {
    std::string name = item.key().substr(1);
    std::ranges::replace(name, '/', '_');
    const Json& value = item.value();
    fields.emplace_back(std::move(name), value.is_null()     ? ""
                                         : value.is_string() ? csv_field(value.get_ref<const std::string&>())
                                                             : value.dump());
  }
  return fields;
}

}  // namespace

std::string format_bench_csv(const BenchContext& context, std::span<const BenchReport> reports) {
  const std::string machine = csv_field(context.machine.cpu);
  const std::string revision =
      csv_field(context.build.revision.empty() ? context.build.version : context.build.revision);
  std::string text;
  for (const BenchReport& report : reports) {
    for (const BenchRow& row : report.rows) {
      const auto fields = csv_fields(report, row);
      if (text.empty()) {
        for (const auto& field : fields) text += field.first + ",";
        text += "rounds,cpu,revision\n";
      }
      for (const auto& field : fields) text += field.second + ",";
      text += std::to_string(context.rounds) + "," + machine + "," + revision + "\n";
    }
  }
  return text;
}

std::string format_bench_json(const BenchContext& context, std::span<const BenchReport> reports) {
  Json inputs = Json::array();
  for (const BenchReport& report : reports) {
    Json input = head_of(report);
    input["settings"] = Json::array();
    for (const BenchRow& row : report.rows) input["settings"].push_back(to_json(report, row));
    inputs.push_back(std::move(input));
  }
  const BenchMachine& machine = context.machine;
  const BenchBuild& build = context.build;
  const Json json{
      {"machine", {{"cpu", machine.cpu}, {"cores", machine.cores}, {"memory_bytes", machine.memory_bytes}}},
      {"build",
       {{"version", build.version},
        {"revision", build.revision},
        {"compiler", build.compiler},
        {"type", build.type},
        {"flags", build.flags},
        {"instructions", build.instructions}}},
      {"rounds", context.rounds},
      {"inputs", inputs}};
  return json.dump(1) + "\n";
}

}  // namespace warmfront::client
