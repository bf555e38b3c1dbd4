// SPDX-License-Identifier: Apache-2.0
// info.json: see info_json.h.
#include "client/io/info_json.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "client/io/text.h"
#include "proto/command_line/unknown_option.h"

namespace warmfront::client {
namespace {

using Json = nlohmann::ordered_json;

/// Reads fields of one object; keeps the first invalid one as the problem.
class Fields {
 public:
  Fields(const Json& object, std::string where) : object_(object), where_(std::move(where)) {}

  void text(const char* key, std::string& value) {
    if (const Json* field = find(key)) {
      if (field->is_string())
        value = field->get<std::string>();
      else
        fail(key, "must be a string");
    }
  }

  void count(const char* key, std::uint64_t most, std::uint64_t& value) {
    if (const Json* field = find(key)) {
      if (field->is_number_unsigned() && field->get<std::uint64_t>() <= most)
        value = field->get<std::uint64_t>();
      else
        fail(key, "must be a whole number in [0, " + std::to_string(most) + "]");
    }
  }

  void flag(const char* key, bool& value) {
    if (const Json* field = find(key)) {
      if (field->is_boolean())
        value = field->get<bool>();
      else
        fail(key, "must be true or false");
    }
  }

  void number(const char* key, double& value) {
    if (const Json* field = find(key)) {
      if (field->is_number())
        value = field->get<double>();
      else
        fail(key, "must be a number");
    }
  }

  void require(const char* key) {
    if (!find(key)) fail(key, "is missing");
  }

  void fail(const char* key, const std::string& what) {
    if (problem_.empty()) problem_ = where_ + "'" + key + "' " + what;
  }

  /// Null where it is missing.
  const Json* find(const char* key) {
    if (!knows(key)) known_.push_back(key);
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }

  /// Refuses every key but those that were looked for.
  void refuse_others() {
    for (const auto& [key, value] : object_.items()) {
      if (!problem_.empty() || knows(key)) continue;
      problem_ = where_ + "unknown key " + in_quotes(key) + "; the known ones are ";
      std::string_view separator;
      for (const std::string_view name : known_) {
        problem_.append(separator).append(name);
        separator = ", ";
      }
    }
  }

  /// Refuses every key that is almost one of `names`, but those that were looked for.
  void refuse_misspelt(std::initializer_list<std::string_view> names) {
    constexpr std::size_t kMostEdits = 2;
    constexpr std::size_t kLong = 8;  // "files" is two edits from "filters", and a word of its own
    for (const auto& [key, value] : object_.items()) {
      if (!problem_.empty() || knows(key)) continue;
      for (const std::string_view name : names) {
        const std::size_t longer = std::max(key.size(), name.size()),
                          shorter = std::min(key.size(), name.size());
        const bool alike = longer - shorter <= (name.size() < kLong ? 1 : kMostEdits);
        if (alike && command_line::edit_distance(key, name) <= kMostEdits)
          problem_ = where_ + "unknown key " + in_quotes(key) + "; is '" + std::string(name) + "' meant?";
      }
    }
  }

  const std::string& problem() const { return problem_; }

 private:
  bool knows(std::string_view key) const { return std::ranges::find(known_, key) != known_.end(); }

  const Json& object_;
  std::string where_;
  std::vector<std::string_view> known_;  // keys that were looked for, in order
  std::string problem_;
};

/// Three finite numbers; false for anything else.
bool parse_three(const Json* list, std::array<double, 3>& three) {
  if (list == nullptr || !list->is_array() || list->size() != 3) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(*list)[k].is_number()) return false;
    three[k] = (*list)[k].get<double>();
  }
  return true;
}

std::string parse_half_space(const Json& item, const std::string& where, HalfSpace& half_space) {
  if (!item.is_object()) return where + "'half_space' must be an object";
  Fields fields(item, where + "half_space: ");
  if (!parse_three(fields.find("point"), half_space.point)) fields.fail("point", "must hold 3 numbers");
  if (!parse_three(fields.find("normal"), half_space.normal)) fields.fail("normal", "must hold 3 numbers");
  fields.refuse_others();
  return fields.problem();
}

// `first`: where the body before it ends.
std::string parse_body(const Json& item, std::size_t index, std::uint64_t first, Body& body) {
  const std::string where = "body " + std::to_string(index) + ": ";
  if (!item.is_object()) return where + "must be an object";
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  Fields fields(item, where);
  std::uint64_t count = 0;
  std::string kind = "deformable";
  fields.require("vertex_count");
  fields.text("name", body.name);
  fields.count("first_vertex", kMost, first);
  fields.count("vertex_count", kMost, count);
  fields.text("kind", kind);
  fields.flag("self_collision", body.self_collision);
  std::uint64_t group = body.group;
  std::uint64_t mask = body.mask;
  fields.count("group", kMost, group);
  fields.count("mask", kMost, mask);
  fields.number("thickness", body.thickness);
  fields.flag("screw", body.screw);
  std::uint64_t world = body.world;
  fields.count("world", kMost, world);
  body.world = static_cast<std::uint32_t>(world);
  if (const Json* half_space = fields.find("half_space")) {
    if (std::string problem = parse_half_space(*half_space, where, body.half_space.emplace());
        !problem.empty())
      return problem;
  }
  body.group = static_cast<std::uint32_t>(group);
  body.mask = static_cast<std::uint32_t>(mask);
  body.first_vertex = static_cast<std::uint32_t>(first);
  body.vertex_count = static_cast<std::uint32_t>(count);
  if (kind == "deformable")
    body.kind = BodyKind::kDeformable;
  else if (kind == "rigid")
    body.kind = BodyKind::kRigid;
  else if (kind == "static")
    body.kind = BodyKind::kStatic;
  else if (kind == "removed")
    body.kind = BodyKind::kRemoved;
  else
    fields.fail("kind", "must be deformable, rigid, static or removed, not " + in_quotes(kind));
  fields.refuse_others();
  return fields.problem();
}

bool is_index(const Json& value) {
  return value.is_number_unsigned() &&
         value.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
}

/// A list of pairs of indices; false for anything else.
bool parse_pairs(const Json& list, std::vector<std::array<std::uint32_t, 2>>& pairs) {
  if (!list.is_array()) return false;
  for (const Json& pair : list) {
    if (!pair.is_array() || pair.size() != 2 || !is_index(pair[0]) || !is_index(pair[1])) return false;
    pairs.push_back({pair[0].get<std::uint32_t>(), pair[1].get<std::uint32_t>()});
  }
  return true;
}

std::string parse_filters(const Json& item, PairFilters& filters) {
  if (!item.is_object()) return "'filters' must be an object";
  Fields fields(item, "filters: ");
  std::uint64_t edges = 0;
  fields.count("within_edges", PairFilters::kMostEdges, edges);
  filters.within_edges = static_cast<std::uint32_t>(edges);
  fields.number("near_at_rest", filters.near_at_rest);
  if (!(filters.near_at_rest >= 0)) fields.fail("near_at_rest", "must be a length, or 0");
  if (const Json* pairs = fields.find("excluded_vertex_pairs");
      pairs && !parse_pairs(*pairs, filters.excluded_vertex_pairs))
    fields.fail("excluded_vertex_pairs", "must hold pairs of vertices");
  if (const Json* patches = fields.find("patches")) {
    bool all = patches->is_array();
    for (std::size_t i = 0; all && i < patches->size(); ++i) {
      all = is_index((*patches)[i]);
      if (all) filters.patches.push_back((*patches)[i].get<std::uint32_t>());
    }
    if (!all) fields.fail("patches", "must hold a whole number for each vertex");
  }
  fields.refuse_others();
  return fields.problem();
}

/// Refuses nesting beyond what the format has, so that hostile input cannot exhaust the stack.
bool too_deep(std::string_view bytes) {
  int depth = 0;
  for (const char c : bytes) {
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    if (depth > 64) return true;
  }
  return false;
}

}  // namespace

std::string_view to_string(BodyKind kind) {
  switch (kind) {
    case BodyKind::kDeformable:
      return "deformable";
    case BodyKind::kRigid:
      return "rigid";
    case BodyKind::kStatic:
      return "static";
    case BodyKind::kRemoved:
      return "removed";
  }
  return "unknown";
}

Result<SceneInfo> parse_info_json(std::string_view bytes, std::string_view file) {
  const std::string prefix = std::string(file) + ": ";
  if (too_deep(bytes)) return invalid_argument(prefix + "nested too deeply");
  Json root;
  try {
    root = Json::parse(bytes);
  } catch (const Json::parse_error& error) {
    return error_at_byte(file, error.byte, "not JSON");
  } catch (const Json::exception& error) {
    return invalid_argument(prefix + "not JSON: " + error.what());
  }
  if (!root.is_object()) return invalid_argument(prefix + "must be an object");

  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  SceneInfo info;
  Fields fields(root, "");
  fields.text("name", info.name);
  fields.count("triangles", kMost, info.triangles);
  fields.count("vertices", kMost, info.vertices);
  fields.count("frames", kMost, info.frames);
  fields.number("fps", info.fps);
  fields.text("generator", info.generator);
  if (const Json* bodies = fields.find("bodies")) {
    if (!bodies->is_array()) return invalid_argument(prefix + "'bodies' must be a list");
    for (std::size_t i = 0; i < bodies->size(); ++i) {
      Body body;
      const std::uint64_t first =
          info.bodies.empty() ? 0
                              : std::uint64_t{info.bodies.back().first_vertex} + info.bodies.back().vertex_count;
      if (const std::string problem = parse_body((*bodies)[i], i, first, body); !problem.empty())
        return invalid_argument(prefix + problem);
      info.bodies.push_back(std::move(body));
    }
  }
  if (const Json* pairs = fields.find("excluded_pairs")) {
    if (!pairs->is_array()) return invalid_argument(prefix + "'excluded_pairs' must be a list");
    if (!parse_pairs(*pairs, info.excluded_pairs))
      return invalid_argument(prefix + "'excluded_pairs' must hold pairs of body indices");
  }
  if (const Json* filters = fields.find("filters")) {
    if (const std::string problem = parse_filters(*filters, info.filters); !problem.empty())
      return invalid_argument(prefix + problem);
  }
  if (const Json* thickness = fields.find("vertex_thickness")) {
    bool all = thickness->is_array();
    for (std::size_t v = 0; all && v < thickness->size(); ++v) {
      all = (*thickness)[v].is_number();
      if (all) info.thickness.push_back((*thickness)[v].get<double>());
    }
    if (!all) return invalid_argument(prefix + "'vertex_thickness' must hold a length for each vertex");
  }
  fields.refuse_misspelt({"bodies", "excluded_pairs", "filters", "vertex_thickness"});
  if (!fields.problem().empty()) return invalid_argument(prefix + fields.problem());
  return info;
}

std::string format_info_json(const SceneInfo& info) {
  Json bodies = Json::array();
  for (const Body& body : info.bodies) {
    Json item{{"name", body.name},
              {"first_vertex", body.first_vertex},
              {"vertex_count", body.vertex_count},
              {"kind", to_string(body.kind)}};
    const Body plain;
    if (body.self_collision != plain.self_collision) item["self_collision"] = body.self_collision;
    if (body.group != plain.group) item["group"] = body.group;
    if (body.mask != plain.mask) item["mask"] = body.mask;
    if (body.thickness > 0) item["thickness"] = body.thickness;
    if (body.world != plain.world) item["world"] = body.world;
    if (body.screw) item["screw"] = true;
    if (body.half_space)
      item["half_space"] = {{"point", body.half_space->point}, {"normal", body.half_space->normal}};
    bodies.push_back(std::move(item));
  }
  Json root{{"name", info.name},
            {"triangles", info.triangles},
            {"vertices", info.vertices},
            {"frames", info.frames},
            {"fps", info.fps},
            {"bodies", std::move(bodies)},
            {"generator", info.generator}};
  if (!info.excluded_pairs.empty()) root["excluded_pairs"] = info.excluded_pairs;
  if (info.filters.any()) {
    Json filters = Json::object();
    if (info.filters.within_edges != 0) filters["within_edges"] = info.filters.within_edges;
    if (info.filters.near_at_rest > 0) filters["near_at_rest"] = info.filters.near_at_rest;
    if (!info.filters.excluded_vertex_pairs.empty())
      filters["excluded_vertex_pairs"] = info.filters.excluded_vertex_pairs;
    if (!info.filters.patches.empty()) filters["patches"] = info.filters.patches;
    root["filters"] = std::move(filters);
  }
  if (!info.thickness.empty()) root["vertex_thickness"] = info.thickness;
  return root.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace warmfront::client
