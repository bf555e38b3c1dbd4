// SPDX-License-Identifier: Apache-2.0
#include "client/python/native/reading.h"

#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <utility>

#include "client/python/native/errors.h"

namespace warmfront::python {
namespace py = pybind11;
namespace {

using Faces = std::vector<std::array<std::int32_t, 3>>;
using Edges = std::vector<std::array<std::int32_t, 2>>;

/// A message's enum lists the engine's names in their order, after UNSPECIFIED.
template <class Enum>
std::optional<Enum> enum_of(py::handle message, const char* field) {
  const int value = message.attr(field).cast<int>();
  if (value == 0) return std::nullopt;
  return static_cast<Enum>(value - 1);
}

template <class T>
void read(py::handle message, const char* field, T& into) {
  into = message.attr(field).cast<T>();
}
/// An optional field, where it is set.
template <class T>
void read_set(py::handle message, const char* field, T& into) {
  if (message.attr("HasField")(field).cast<bool>()) read(message, field, into);
}
template <class T>
void read_set(py::handle message, const char* field, std::optional<T>& into) {
  if (message.attr("HasField")(field).cast<bool>()) read(message, field, into.emplace());
}
template <class Enum>
void read_enum(py::handle message, const char* field, Enum& into) {
  into = enum_of<Enum>(message, field).value_or(into);
}

ContactFields fields_of(py::handle message) {
  ContactFields fields;
  read(message, "weights", fields.weights);
  read(message, "normal", fields.normal);
  read(message, "points", fields.points);
  read(message, "direction", fields.direction);
  read(message, "squared_distance", fields.squared_distance);
  read(message, "closest", fields.closest);
  return fields;
}

std::array<double, 3> three_of(py::handle numbers) {
  return {numbers[py::int_(0)].cast<double>(), numbers[py::int_(1)].cast<double>(),
          numbers[py::int_(2)].cast<double>()};
}

template <class Row>
std::vector<Row> field_rows(py::handle message, const char* field) {
  return rows_of<Row>(message.attr(field).cast<py::buffer>());
}

std::vector<double> positions_in(py::handle message, bool float32) {
  if (!float32) return field_rows<double>(message, "positions");
  const std::vector<float> values = field_rows<float>(message, "positions");
  return {values.begin(), values.end()};
}

BodyAddition addition_of(py::handle message, const std::string& where) {
  return {body_of(message.attr("body"), where + ".body"), field_rows<Faces::value_type>(message, "faces"),
          field_rows<Edges::value_type>(message, "edges"), field_rows<double>(message, "thickness")};
}

}  // namespace

ColliderOptions options_of(py::handle message) {
  ColliderOptions options;
  read_enum(message, "tier", options.tier);
  read_enum(message, "report", options.report);
  read_enum(message, "front", options.front);
  read_enum(message, "bounds", options.bounds);
  read_set(message, "find_bodies", options.find_bodies);
  read_set(message, "find_rigid", options.find_rigid);
  read_set(message, "separate_parts", options.separate_parts);
  read_set(message, "explain", options.explain);
  read_set(message, "tolerance", options.tolerance);
  read_set(message, "min_separation", options.min_separation);
  read_set(message, "normal_cones", options.normal_cones);
  read_set(message, "lazy_front", options.lazy_front);
  options.fields = fields_of(message.attr("fields"));
  read_set(message, "leaf_size", options.leaf_size);
  read_set(message, "rebuild_after_stalled_steps", options.rebuild_after_stalled_steps);
  read_set(message, "rebuild_every_steps", options.rebuild_every_steps);
  read_set(message, "max_front_bytes", options.max_front_bytes);
  read_set(message, "max_contacts", options.max_contacts);
  return options;
}

Question question_of(py::handle message) {
  Question question;
  QuestionOptions& options = question.options;
  read_enum(message, "kind", question.kind);
  options.tier = enum_of<Tier>(message, "tier");
  options.report = enum_of<Report>(message, "report");
  read_set(message, "tolerance", options.tolerance);
  read_set(message, "min_separation", options.min_separation);
  if (message.attr("HasField")("fields").cast<bool>()) options.fields = fields_of(message.attr("fields"));
  read_set(message, "max_contacts", options.max_contacts);
  read(message, "leave_out_overlaps", question.leave_out_overlaps);
  read_set(message, "keep_distance", options.keep_distance);
  read(message, "reduced", options.reduced);
  read_enum(message, "where", question.where);
  return question;
}

Body body_of(py::handle message, const std::string& where) {
  Body body;
  read(message, "name", body.name);
  if (const Status name = check_name(body.name, where); !name) throw raised(name.error());
  read(message, "first_vertex", body.first_vertex);
  read(message, "vertex_count", body.vertex_count);
  read_enum(message, "kind", body.kind);
  read_set(message, "self_collision", body.self_collision);
  read_set(message, "group", body.group);
  read_set(message, "mask", body.mask);
  read(message, "thickness", body.thickness);
  read(message, "world", body.world);
  read(message, "screw", body.screw);
  if (message.attr("HasField")("half_space").cast<bool>()) {
    const py::object half_space = message.attr("half_space");
    body.half_space = {three_of(half_space.attr("point")), three_of(half_space.attr("normal"))};
  }
  return body;
}

std::vector<std::array<std::uint32_t, 2>> body_pairs_of(py::handle pairs) {
  std::vector<std::array<std::uint32_t, 2>> result;
  for (const py::handle pair : pairs)
    result.push_back({pair.attr("a").cast<std::uint32_t>(), pair.attr("b").cast<std::uint32_t>()});
  return result;
}

PairFilters filters_of(py::handle message) {
  PairFilters filters;
  read(message, "within_edges", filters.within_edges);
  read(message, "near_at_rest", filters.near_at_rest);
  filters.rest_positions = field_rows<double>(message, "rest_positions");
  filters.excluded_vertex_pairs = field_rows<std::array<std::uint32_t, 2>>(message, "excluded_vertex_pairs");
  filters.patches = field_rows<std::uint32_t>(message, "patches");
  return filters;
}

SceneChange change_of(py::handle message, bool float32) {
  const auto what = message.attr("WhichOneof")("what").cast<std::string>();
  const py::object change = message.attr(what.c_str());
  const std::string where = "changes[0]." + what;
  if (what == "add") return AddBody{addition_of(change, where), positions_in(change, float32)};
  if (what == "change")
    return ChangeBody{change.attr("index").cast<std::uint32_t>(),
                      body_of(change.attr("body"), where + ".body")};
  if (what == "change_filters") return ChangeFilters{filters_of(change)};
  if (what == "change_excluded_pairs") return ChangeExcludedPairs{body_pairs_of(change.attr("pairs"))};
  if (what == "replace_elements")
    return ReplaceElements{change.attr("index").cast<std::uint32_t>(),
                           field_rows<Faces::value_type>(change, "faces"),
                           field_rows<Edges::value_type>(change, "edges")};
  const py::object with = change.attr("with");
  return ReplaceBody{change.attr("index").cast<std::uint32_t>(), addition_of(with, where + ".with"),
                     positions_in(with, float32)};
}

void tell(const ColliderOptions& options, py::handle message) {
  const auto number = [](auto choice) { return static_cast<int>(choice) + 1; };
  message.attr("tier") = number(options.tier);
  message.attr("report") = number(options.report);
  message.attr("front") = number(options.front);
  message.attr("bounds") = number(options.bounds);
  message.attr("find_bodies") = options.find_bodies;
  message.attr("find_rigid") = options.find_rigid;
  message.attr("separate_parts") = options.separate_parts;
  message.attr("explain") = options.explain;
  message.attr("tolerance") = options.tolerance;
  message.attr("min_separation") = options.min_separation;
  message.attr("normal_cones") = options.normal_cones;
  message.attr("lazy_front") = options.lazy_front;
  message.attr("leaf_size") = options.leaf_size;
  message.attr("rebuild_after_stalled_steps") = options.rebuild_after_stalled_steps;
  message.attr("rebuild_every_steps") = options.rebuild_every_steps;
  message.attr("max_front_bytes") = options.max_front_bytes;
  message.attr("max_contacts") = options.max_contacts;
  const py::object fields = message.attr("fields");
  fields.attr("weights") = options.fields.weights;
  fields.attr("normal") = options.fields.normal;
  fields.attr("points") = options.fields.points;
  fields.attr("direction") = options.fields.direction;
  fields.attr("squared_distance") = options.fields.squared_distance;
  fields.attr("closest") = options.fields.closest;
}

void tell(const PairFilters& filters, py::handle message) {
  if (!filters.any()) return;
  message.attr("within_edges") = filters.within_edges;
  message.attr("near_at_rest") = filters.near_at_rest;
  message.attr("excluded_vertex_pair_count") = filters.excluded_vertex_pairs.size();
  message.attr("patches") = !filters.patches.empty();
}

Positions positions_of(const py::buffer_info& info) {
  const auto count = static_cast<std::size_t>(info.size);
  if (info.itemsize == sizeof(float)) return std::span(static_cast<const float*>(info.ptr), count);
  return std::span(static_cast<const double*>(info.ptr), count);
}

}  // namespace warmfront::python
