// SPDX-License-Identifier: Apache-2.0
#include "client/cli/ranges/range_report.h"

#include <algorithm>
#include <filesystem>

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// Reads the members of an object, and remembers the first that is missing or of another type.
class Members {
 public:
  explicit Members(const Json& object) : object_(object) {}

  template <class T>
  void read(const char* name, T& value) {
    const auto found = object_.find(name);
    const bool fits = found != object_.end() && is<T>(*found);
    if (fits)
      value = found->template get<T>();
    else if (wrong_.empty())
      wrong_ = name;
  }
  /// Null, or an object or a text for `read_value`, which says whether it is right.
  template <class Read>
  void read_optional(const char* name, Read read_value) {
    const auto found = object_.find(name);
    if (found != object_.end() && (found->is_null() || read_value(*found))) return;
    if (wrong_.empty()) wrong_ = name;
  }

  const std::string& wrong() const { return wrong_; }

 private:
  static bool is_index(const Json& json) {
    return json.is_number_unsigned() && json.get<std::uint64_t>() <= 0xffffffff;
  }
  template <class T>
  static bool is(const Json& json) {
    if constexpr (std::is_same_v<T, std::string>)
      return json.is_string();
    else if constexpr (std::is_same_v<T, std::uint32_t>)
      return is_index(json);
    else if constexpr (std::is_same_v<T, std::uint64_t>)
      return json.is_number_unsigned();
    else
      return json.is_array() && std::ranges::all_of(json, is_index);
  }

  const Json& object_;
  std::string wrong_;
};

}  // namespace

Json to_json(const RangeReport& range) {
  Json json{{"version", range.version},     {"input", range.input},
            {"digest", range.digest},       {"first", range.frames.first},
            {"last", range.frames.last},    {"last_of_input", range.last_of_input},
            {"substeps", range.substeps},   {"topology_changes", range.topology_changes},
            {"starts_at", range.starts_at}, {"ends_at", range.ends_at},
            {"contacts", nullptr},          {"hash", nullptr}};
  if (range.contacts) json["contacts"] = {{"file", range.contacts->file}, {"rows", range.contacts->rows}};
  if (range.hash) json["hash"] = range.hash->text();
  return json;
}

Result<RangeReport> range_from_json(const Json& json) {
  if (!json.is_object()) return invalid_argument("\"range\" is no object");
  RangeReport range;
  Members members(json);
  members.read("version", range.version);
  members.read("input", range.input);
  members.read("digest", range.digest);
  members.read("first", range.frames.first);
  members.read("last", range.frames.last);
  members.read("last_of_input", range.last_of_input);
  members.read("substeps", range.substeps);
  members.read("topology_changes", range.topology_changes);
  members.read("starts_at", range.starts_at);
  members.read("ends_at", range.ends_at);
  members.read_optional("contacts", [&range](const Json& object) {
    if (!object.is_object()) return false;
    Members contacts(object);
    range.contacts.emplace();
    contacts.read("file", range.contacts->file);
    contacts.read("rows", range.contacts->rows);
    return contacts.wrong().empty();
  });
  members.read_optional("hash", [&range](const Json& text) {
    if (text.is_string()) range.hash = ContactHashPart::parse(text.get_ref<const std::string&>());
    return range.hash.has_value();
  });
  if (!members.wrong().empty())
    return invalid_argument("\"range\" has no \"" + members.wrong() + "\", or a wrong one");
  if (range.substeps == 0 || range.frames.first >= range.frames.last ||
      range.frames.last > range.last_of_input)
    return invalid_argument("\"range\" names frames " + to_text(range.frames) +
                            " of 0:" + std::to_string(range.last_of_input) + " in " +
                            std::to_string(range.substeps) + " substeps, which is no range");
  return range;
}

std::string beside_report(const std::string& file, const std::string& report) {
  namespace fs = std::filesystem;
  const fs::path absolute = fs::absolute(file).lexically_normal();
  if (report == "-") return absolute.string();
  return absolute.lexically_proximate(fs::absolute(report).lexically_normal().parent_path()).string();
}

std::string to_text(FrameRange range) {
  return std::to_string(range.first) + ":" + std::to_string(range.last);
}

}  // namespace warmfront::client
