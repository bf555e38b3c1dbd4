// SPDX-License-Identifier: Apache-2.0
#include "client/cli/merge/merged.h"

#include <algorithm>
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

#include "client/cli/detect/table.h"
#include "client/cli/interrupt.h"
#include "client/cli/print.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t contacts_of(const Json& frame) {
  return frame["vf"].get<std::uint64_t>() + frame["ee"].get<std::uint64_t>() +
         frame["vh"].get<std::uint64_t>();
}

/// Keeps the kWorst that `worse` puts first.
template <class Worse>
void keep(std::vector<OfFrame>& list, OfFrame one, Worse worse) {
  const auto at = std::ranges::upper_bound(list, one.value, worse, &OfFrame::value);
  list.insert(at, one);
  if (list.size() > kWorst) list.pop_back();
}

void add_frame(Merged& merged, const Json& frame) {
  const auto number = frame["frame"].get<std::uint64_t>();
  const auto ms = frame["ms"]["total"].get<double>();
  merged.vf += frame["vf"].get<std::uint64_t>();
  merged.ee += frame["ee"].get<std::uint64_t>();
  merged.vh += frame["vh"].get<std::uint64_t>();
  merged.possible += frame["possible"].get<std::uint64_t>();
  merged.ms += ms;
  if (const std::uint64_t contacts = contacts_of(frame); contacts > 0)
    keep(merged.most_contacts, {number, static_cast<double>(contacts)}, std::greater<>());
  if (frame["earliest_toi"].is_number())
    keep(merged.earliest, {number, frame["earliest_toi"].get<double>()}, std::less<>());
  keep(merged.slowest, {number, ms}, std::greater<>());
}

/// Where no step is missing: of the first part its own hash, which the others go on from.
void take_hash(Merged& merged, std::span<const Part> parts) {
  const auto& text = parts.front().report["contacts_hash"].get_ref<const std::string&>();
  if (text.empty()) return;
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value, 16);
  merged.hash = parts.front().range.hash;
  for (const Part& part : parts.subspan(1)) {
    value = part.range.hash->after(value);
    if (merged.hash) merged.hash->append(*part.range.hash);
  }
  merged.contacts_hash = ContactHash(value).hex();
}

/// The value of a field where all parts have the same, else null.
Json agreed(std::span<const Part> parts, const char* field) {
  const Json first = parts.front().report.value(field, Json());
  const auto same = [&](const Part& part) { return part.report.value(field, Json()) == first; };
  return std::ranges::all_of(parts, same) ? first : Json();
}

Json worst_json(const std::vector<OfFrame>& list, const char* name, bool whole) {
  Json rows = Json::array();
  for (const OfFrame& one : list)
    rows.push_back({{"frame", one.frame},
                    {name, whole ? Json(static_cast<std::uint64_t>(one.value)) : Json(one.value)}});
  return rows;
}

FrameReport row_of(const Json& frame) {
  FrameReport row;
  row.frame = frame["frame"];
  row.vf = frame["vf"];
  row.ee = frame["ee"];
  row.vh = frame["vh"];
  row.possible = frame["possible"];
  if (frame["earliest_toi"].is_number()) row.earliest_toi = frame["earliest_toi"].get<double>();
  const auto number = [&frame](const char* group, const char* name) {
    const auto of = frame.find(group);
    if (of == frame.end() || !of->is_object()) return 0.0;
    const auto found = of->find(name);
    return found != of->end() && found->is_number() ? found->get<double>() : 0.0;
  };
  StageTimes& ms = row.statistics.ms;
  ms.total = number("ms", "total");
  ms.refit = number("ms", "refit");
  ms.front = number("ms", "front");
  ms.elementary = number("ms", "elementary");
  ms.adjacent = number("ms", "adjacent");
  row.statistics.counts.triangle_pairs = static_cast<std::uint64_t>(number("counts", "triangle_pairs"));
  const Json state = frame.value("front_state", Json());
  for (const FrontState one : {FrontState::kNone, FrontState::kBuilt, FrontState::kUpdated,
                               FrontState::kRebuilt, FrontState::kCapped})
    if (state == std::string(to_string(one))) row.statistics.front_state = one;
  return row;
}

void print_worst(const char* what, const char* format, const std::vector<OfFrame>& list) {
  if (list.empty()) return;
  const WholeRow row;
  std::printf("%s: ", what);
  const char* separator = "";
  for (const OfFrame& one : list) {
    std::printf("%sframe %" PRIu64 " (", separator, one.frame);
    std::printf(format, one.value);
    std::printf(")");
    separator = ", ";
  }
  std::printf("\n");
}

std::size_t count_steps(std::span<const Part> parts) {
  std::size_t steps = 0;
  for (const Part& part : parts) steps += part.report["frames"].size();
  return steps;
}

void print_steps(std::span<const Part> parts, Steps which, bool half_spaces) {
  std::vector<const Json*> shown;
  for (const Part& part : parts)
    for (const Json& frame : part.report["frames"]) shown.push_back(&frame);
  if (which == Steps::kWorst && shown.size() > kWorstLines) {
    std::ranges::stable_sort(shown, std::greater<>{}, [](const Json* frame) { return contacts_of(*frame); });
    std::printf("the %zu of %zu steps with the most contacts (--steps: all):\n", kWorstLines, shown.size());
    shown.resize(kWorstLines);
  }
  print_detect_header(half_spaces);
  for (const Json* frame : shown) print_detect_row(row_of(*frame), half_spaces);
}

}  // namespace

Merged merge_parts(std::span<const Part> parts, FrameRange frames, std::vector<FrameRange> missing) {
  Merged merged;
  merged.reports = parts.size();
  merged.frames = frames;
  merged.missing = std::move(missing);
  for (const Part& part : parts)
    for (const Json& frame : part.report["frames"]) add_frame(merged, frame);
  if (merged.missing.empty()) take_hash(merged, parts);
  return merged;
}

std::string format_json(const Merged& merged, std::span<Part> parts,
                        const std::optional<WrittenContacts>& contacts) {
  const Json& first = parts.front().report;
  Json root;
  for (const char* field : {"vertices", "triangles", "edges", "tier", "tolerance"})
    root[field] = first[field];
  for (const char* field : {"threads", "front", "bounds"}) root[field] = agreed(parts, field);
  root["contacts_hash"] = merged.contacts_hash;
  for (const char* field : {"filters", "most_thickness"}) root[field] = first.value(field, Json());
  RangeReport range = parts.front().range;
  range.frames = merged.frames;
  range.ends_at = parts.back().range.ends_at;
  range.hash = merged.hash;
  range.contacts = contacts;
  // Only what is whole is a part of more.
  if (merged.missing.empty()) root["range"] = to_json(range);
  Json gaps = Json::array();
  for (const FrameRange gap : merged.missing) gaps.push_back({gap.first, gap.last});
  root["missing"] = std::move(gaps);
  root["reports"] = merged.reports;
  root["worst"] = {{"most_contacts", worst_json(merged.most_contacts, "contacts", true)},
                   {"earliest", worst_json(merged.earliest, "earliest_toi", false)},
                   {"slowest", worst_json(merged.slowest, "ms", false)}};
  Json& frames = root["frames"] = Json::array();
  for (Part& part : parts)
    for (Json& frame : part.report["frames"]) frames.push_back(std::move(frame));
  return root.dump(1) + "\n";
}

void print(const Merged& merged, std::span<const Part> parts, Steps lines) {
  const std::size_t steps = count_steps(parts);
  const std::string of_half_spaces = merged.vh > 0 ? ", " + std::to_string(merged.vh) + " vh" : "";
  std::printf("%s in %s: %s (%" PRIu64 " vf, %" PRIu64 " ee%s; %" PRIu64 " possible), %.3f ms a step\n",
              counted(steps, "step").c_str(), counted(merged.reports, "report").c_str(),
              counted(merged.vf + merged.ee + merged.vh, "contact").c_str(), merged.vf, merged.ee,
              of_half_spaces.c_str(), merged.possible, merged.ms / static_cast<double>(steps));
  print_worst("most contacts", "%.0f", merged.most_contacts);
  print_worst("earliest", "%.9f", merged.earliest);
  print_worst("slowest", "%.3f ms", merged.slowest);
  if (!merged.contacts_hash.empty()) std::printf("contacts hash %s\n", merged.contacts_hash.c_str());
  if (lines != Steps::kNone) print_steps(parts, lines, merged.vh > 0);
}

}  // namespace warmfront::client
