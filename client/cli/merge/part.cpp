// SPDX-License-Identifier: Apache-2.0
#include "client/cli/merge/part.h"

#include <algorithm>
#include <array>
#include <utility>

#include "client/io/file.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// Why the frames of the report are not those of its range; empty where they are.
std::string wrong_frames(const Json& frames, const RangeReport& range) {
  const std::uint64_t steps = std::uint64_t{range.frames.last - range.frames.first} * range.substeps;
  if (!frames.is_array() || frames.size() != steps)
    return "\"frames\" is no list of " + std::to_string(steps) + " steps";
  std::uint64_t number = std::uint64_t{range.frames.first} * range.substeps;
  for (const Json& frame : frames) {
    const std::string which = "the step to frame " + std::to_string(++number);
    if (!frame.is_object() || frame.value("frame", Json()) != number) return "\"frames\" lacks " + which;
    for (const char* count : {"vf", "ee", "vh", "possible"})
      if (!frame.contains(count) || !frame[count].is_number_unsigned())
        return which + " has no \"" + count + "\"";
    if (!frame.contains("earliest_toi") ||
        !(frame["earliest_toi"].is_null() || frame["earliest_toi"].is_number()))
      return which + " has no \"earliest_toi\"";
    if (!frame.contains("ms") || !frame["ms"].is_object() || !frame["ms"].contains("total") ||
        !frame["ms"]["total"].is_number())
      return which + " has no \"ms\"";
  }
  return "";
}

/// Why the report is not whole; empty where it is.
std::string defect_of(const Part& part) {
  const Json& report = part.report;
  for (const char* number : {"vertices", "triangles", "edges", "tolerance"})
    if (!report.contains(number) || !report[number].is_number())
      return std::string("it has no \"") + number + "\"";
  for (const char* text : {"tier", "contacts_hash"})
    if (!report.contains(text) || !report[text].is_string()) return std::string("it has no \"") + text + "\"";
  const std::string& hash = report["contacts_hash"].get_ref<const std::string&>();
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  if (!hash.empty() && (hash.size() != 16 || !std::ranges::all_of(hash, is_digit)))
    return "\"contacts_hash\" is none";
  if (!hash.empty() && part.range.frames.first > 0 && !part.range.hash) return "\"range\" has no \"hash\"";
  return wrong_frames(report.contains("frames") ? report["frames"] : Json(), part.range);
}

std::string in_words(const Part& part) {
  return part.path + " (frames " + to_text(part.range.frames) + ")";
}

Error not_together(const Part& a, const Part& b, const std::string& why) {
  return invalid_argument(in_words(b) + " is no part of the same run as " + in_words(a) + ": " + why);
}

/// What a reader can see that differs, before the digest that covers all of it.
Status check_alike(const Part& a, const Part& b) {
  const auto differ = [&](const char* what, const std::string& of_a, const std::string& of_b) {
    return not_together(a, b,
                        std::string(what) + " " + of_b + ", not " + of_a +
                            "; give reports of one input, made with the same options");
  };
  const RangeReport &x = a.range, &y = b.range;
  if (x.version != y.version)
    return not_together(a, b,
                        "it was made by warmfront " + y.version + ", not " + x.version +
                            "; run 'warmfront detect' again for one of them");
  if (x.input != y.input) return differ("the input is", x.input, y.input);
  if (x.last_of_input != y.last_of_input)
    return differ("the input's last frame is", std::to_string(x.last_of_input),
                  std::to_string(y.last_of_input));
  if (x.substeps != y.substeps)
    return differ("--substeps is", std::to_string(x.substeps), std::to_string(y.substeps));
  for (const auto& [field, name] : {std::pair("tier", "--tier is"), std::pair("tolerance", "--tolerance is")})
    if (a.report[field] != b.report[field])
      return differ(name, a.report[field].dump(), b.report[field].dump());
  if (x.digest != y.digest || (a.report["contacts_hash"] == "") != (b.report["contacts_hash"] == ""))
    return not_together(
        a, b,
        "the scene, its first frame, or an option that decides which contacts there are (such as "
        "--min-separation, --report, --filter-*, --fields) differs; run 'warmfront detect' again "
        "for one of them, with the options of the other");
  return {};
}

Status check_seam(const Part& a, const Part& b) {
  const FrameRange &x = a.range.frames, &y = b.range.frames;
  if (y.first < x.last)
    return invalid_argument(
        in_words(a) + " and " + in_words(b) +
        " have frames in common; give only one of them, or ranges that begin where the one "
        "before ends");
  const bool changes = std::ranges::find(a.range.topology_changes, x.last) != a.range.topology_changes.end();
  if (x.last == y.first && !changes && a.range.ends_at != b.range.starts_at)
    return invalid_argument(in_words(b) + " begins with other positions than " + in_words(a) +
                            " ends with: the input was changed between the two runs; run both again");
  return {};
}

}  // namespace

Result<Part> read_part(const std::string& path) {
  const Result<std::string> bytes = read_file(path);
  if (!bytes) return bytes.error();
  Part part;
  part.path = path;
  part.report = Json::parse(bytes.value(), nullptr, false);
  if (part.report.is_discarded())
    return invalid_argument(path + ": no JSON, or cut short; run 'warmfront detect --json' for it again");
  if (!part.report.is_object() || !part.report.contains("range"))
    return invalid_argument(path + ": no report of 'warmfront detect --json': it has no \"range\"");
  Result<RangeReport> range = range_from_json(part.report["range"]);
  if (!range) return invalid_argument(path + ": " + range.error().message);
  part.range = std::move(range).value();
  if (const std::string defect = defect_of(part); !defect.empty())
    return invalid_argument(path + ": " + defect + "; run 'warmfront detect --json' for it again");
  return part;
}

Status order_parts(std::vector<Part>& parts) {
  std::ranges::stable_sort(parts, {}, [](const Part& part) {
    return std::array{part.range.frames.first, part.range.frames.last};
  });
  for (std::size_t i = 1; i < parts.size(); ++i) {
    if (Status status = check_alike(parts[0], parts[i]); !status) return status;
    if (Status status = check_seam(parts[i - 1], parts[i]); !status) return status;
  }
  return {};
}

Result<std::vector<FrameRange>> missing_ranges(std::span<const Part> parts, FrameRange wanted) {
  std::vector<FrameRange> missing;
  std::uint32_t at = wanted.first;
  for (const Part& part : parts) {
    const FrameRange frames = part.range.frames;
    if (frames.first < wanted.first || frames.last > wanted.last)
      return invalid_argument(in_words(part) + " reaches beyond --frames " + to_text(wanted) +
                              "; leave it out, or ask for more");
    if (at < frames.first) missing.push_back({at, frames.first});
    at = frames.last;
  }
  if (at < wanted.last) missing.push_back({at, wanted.last});
  return missing;
}

}  // namespace warmfront::client
