// SPDX-License-Identifier: Apache-2.0
// PLY: see ply.h. One parser for ASCII and binary files, over a small source of scalars (ply_source.h).
#include "client/io/ply.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "client/io/ply_header.h"
#include "client/io/ply_source.h"
#include "client/io/text.h"

namespace warmfront::client {
namespace {

std::string entry_name(const PlyElement& element, std::uint64_t index) {
  return element.name + " " + std::to_string(index);
}

/// A number of the file for a message: whole numbers without decimals.
std::string spelled(double value) {
  const bool whole = std::abs(value) < 1e15 && value == std::floor(value);
  return whole ? std::to_string(static_cast<std::int64_t>(value)) : std::to_string(value);
}

/// What is wrong with an entry, if its source has no error itself.
using Problem = std::optional<std::string>;

/// A list's length; none when the source failed or the value is not a valid length.
template <class Source>
std::optional<std::uint64_t> read_length(Source& source, PlyType type, Problem& problem) {
  double value = 0;
  if (!source.read(type, value)) return std::nullopt;
  if (!(value >= 0) || value > std::numeric_limits<std::uint32_t>::max() || value != std::floor(value)) {
    problem = "a list cannot have " + spelled(value) + " entries";
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(value);
}

/// Skips a property.
template <class Source>
bool skip(Source& source, const PlyProperty& property, Problem& problem) {
  std::uint64_t count = 1;
  if (property.length_type) {
    const std::optional<std::uint64_t> length = read_length(source, *property.length_type, problem);
    if (!length) return false;
    count = *length;
  }
  double ignored = 0;
  for (std::uint64_t i = 0; i < count; ++i)
    if (!source.read(property.type, ignored)) return false;
  return true;
}

/// Reads the element's entries one by one: `visit(entry, property_index, property)` reads or skips one
/// property and reports its own error, if any.
template <class Source, class Visit>
Status for_each_entry(Source& source, const PlyHeader& header, const PlyElement& element, Visit visit) {
  if (element.count == 0) return {};
  if (element.properties.empty())
    return source.error("element " + in_quotes(element.name) + " has no properties");
  // Check that the file is long enough before allocating.
  if (element.count > source.remaining() / element.least_bytes(header.format))
    return source.error("the header says " + std::to_string(element.count) + " entries of " +
                        in_quotes(element.name) + ", more than the rest of the file can hold");
  for (std::uint64_t entry = 0; entry < element.count; ++entry) {
    bool good = source.begin_entry();
    for (std::size_t p = 0; good && p < element.properties.size(); ++p) {
      Problem problem;
      good = visit(entry, p, problem);
      if (problem) return source.error(entry_name(element, entry) + ": " + *problem);
    }
    if (!good || !source.end_entry())
      return source.error(entry_name(element, entry) + ": " + source.problem());
  }
  return {};
}

/// Which property holds axis 0, 1, 2.
Result<std::array<std::size_t, 3>> find_axes(const PlyElement& vertices, std::string_view file) {
  std::array<std::size_t, 3> axes{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    const auto found = std::find_if(vertices.properties.begin(), vertices.properties.end(),
                                    [&](const PlyProperty& p) { return p.name == name && !p.length_type; });
    if (found == vertices.properties.end())
      return invalid_argument(std::string(file) + ": element 'vertex' has no scalar property '" + name + "'");
    axes[axis] = static_cast<std::size_t>(found - vertices.properties.begin());
  }
  return axes;
}

bool float_holds(PlyType type) {
  return type != PlyType::kFloat64 && type != PlyType::kInt32 && type != PlyType::kUint32;
}

template <class Source, class T>
Status read_vertices(Source& source, const PlyHeader& header, const PlyElement& element,
                     const std::array<std::size_t, 3>& axes, std::vector<T>& positions) {
  return for_each_entry(source, header, element, [&](std::uint64_t entry, std::size_t p, Problem& problem) {
    if (positions.size() == 3 * entry) positions.resize(3 * entry + 3);
    double value = 0;
    const PlyProperty& property = element.properties[p];
    const auto axis = std::find(axes.begin(), axes.end(), p);
    if (axis == axes.end()) return skip(source, property, problem);
    if (!source.read(property.type, value)) return false;
    positions[3 * entry + static_cast<std::size_t>(axis - axes.begin())] = static_cast<T>(value);
    return true;
  });
}

/// A vertex index; none when the source failed or the value is not one.
template <class Source>
std::optional<std::int32_t> read_vertex(Source& source, PlyType type, std::uint64_t vertex_count,
                                        Problem& problem) {
  double value = 0;
  if (!source.read(type, value)) return std::nullopt;
  if (value >= 0 && value < static_cast<double>(vertex_count) && value == std::floor(value))
    return static_cast<std::int32_t>(value);
  problem = "vertex index " + spelled(value) + " is not a whole number in [0, " +
            std::to_string(vertex_count) + ")";
  return std::nullopt;
}

template <class Source>
Status read_edges(Source& source, const PlyHeader& header, const PlyElement& element,
                  std::uint64_t vertex_count, Mesh& mesh, std::string_view file) {
  std::array<std::size_t, 2> ends{};  // which property holds each
  for (std::size_t end = 0; end < 2; ++end) {
    const std::string name = "vertex" + std::to_string(end + 1);
    const auto found = std::ranges::find_if(
        element.properties, [&](const PlyProperty& p) { return p.name == name && !p.length_type; });
    if (element.count > 0 && found == element.properties.end())
      return invalid_argument(std::string(file) + ": element 'edge' has no scalar property '" + name + "'");
    ends[end] = static_cast<std::size_t>(found - element.properties.begin());
  }
  std::array<std::int32_t, 2> edge{};
  return for_each_entry(source, header, element, [&](std::uint64_t, std::size_t p, Problem& problem) {
    const PlyProperty& property = element.properties[p];
    const auto end = std::ranges::find(ends, p);
    if (end != ends.end()) {
      const std::optional<std::int32_t> v = read_vertex(source, property.type, vertex_count, problem);
      if (!v) return false;
      edge[static_cast<std::size_t>(end - ends.begin())] = *v;
    } else if (!skip(source, property, problem)) {
      return false;
    }
    if (p + 1 < element.properties.size()) return true;
    if (edge[0] == edge[1]) {
      problem = "it joins vertex " + std::to_string(edge[0]) + " to itself";
      return false;
    }
    mesh.edges.push_back(edge);
    return true;
  });
}

template <class Source>
Status read_faces(Source& source, const PlyHeader& header, const PlyElement& element,
                  std::uint64_t vertex_count, Mesh& mesh, std::string_view file) {
  const auto indices =
      std::find_if(element.properties.begin(), element.properties.end(), [](const PlyProperty& p) {
        return p.length_type && (p.name == "vertex_indices" || p.name == "vertex_index");
      });
  if (element.count > 0 && indices == element.properties.end())
    return invalid_argument(std::string(file) + ": element 'face' has no list 'vertex_indices'");
  std::vector<std::int32_t> polygon;
  return for_each_entry(source, header, element, [&](std::uint64_t entry, std::size_t p, Problem& problem) {
    const PlyProperty& property = element.properties[p];
    if (&property != &*indices) return skip(source, property, problem);
    const std::optional<std::uint64_t> length = read_length(source, *property.length_type, problem);
    if (!length) return false;
    polygon.clear();
    for (std::uint64_t i = 0; i < *length; ++i) {
      const std::optional<std::int32_t> v = read_vertex(source, property.type, vertex_count, problem);
      if (!v) return false;
      polygon.push_back(*v);
    }
    if (polygon.size() < 3) {
      problem = "it has " + std::to_string(polygon.size()) + " vertices; a face needs three";
      return false;
    }
    append_face(polygon, source.line(), entry, mesh);
    return true;
  });
}

template <class Source>
Result<Mesh> read_body(Source source, const PlyHeader& header, std::string_view file) {
  const PlyElement* vertices = header.find("vertex");
  if (!vertices) return invalid_argument(std::string(file) + ": no element 'vertex'");
  if (const PlyElement* strips = header.find("tristrips"); strips && strips->count > 0)
    return invalid_argument(std::string(file) + ": element 'tristrips' is not supported; save it with faces");
  if (vertices->count > static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max()))
    return invalid_argument(std::string(file) + ": more than 2147483647 vertices");
  const Result<std::array<std::size_t, 3>> axes = find_axes(*vertices, file);
  if (!axes) return axes.error();

  Mesh mesh;
  const bool single = std::all_of(axes.value().begin(), axes.value().end(),
                                  [&](std::size_t p) { return float_holds(vertices->properties[p].type); });
  if (!single) mesh.positions.emplace<std::vector<double>>();
  for (const PlyElement& element : header.elements) {
    Status status;
    if (&element == vertices) {
      status = std::visit(
          [&](auto& positions) { return read_vertices(source, header, element, axes.value(), positions); },
          mesh.positions);
    } else if (element.name == "face") {
      status = read_faces(source, header, element, vertices->count, mesh, file);
    } else if (element.name == "edge") {
      status = read_edges(source, header, element, vertices->count, mesh, file);
    } else {
      status = for_each_entry(source, header, element, [&](std::uint64_t, std::size_t p, Problem& problem) {
        return skip(source, element.properties[p], problem);
      });
    }
    if (!status) return status.error();
  }
  return mesh;
}

}  // namespace

Result<Mesh> parse_ply(std::string_view bytes, std::string_view file) {
  const Result<PlyHeader> header = parse_ply_header(bytes, file);
  if (!header) return header.error();
  if (header.value().format == PlyFormat::kAscii)
    return read_body(AsciiSource(bytes, header.value(), file), header.value(), file);
  return read_body(BinarySource(bytes, header.value(), file), header.value(), file);
}

std::string format_ply(const Mesh& mesh, std::string_view comment) {
  const std::string type = mesh.positions.index() == 0 ? "float" : "double";
  std::string out = "ply\nformat binary_little_endian 1.0\n";
  if (!comment.empty()) out.append("comment ").append(comment).append("\n");
  out += "element vertex " + std::to_string(vertex_count(mesh.positions)) + "\n";
  for (const char axis : {'x', 'y', 'z'}) out += "property " + type + " " + axis + "\n";
  out += "element face " + std::to_string(mesh.faces.size()) + "\n";
  out += "property list uchar int vertex_indices\n";
  if (!mesh.edges.empty())
    out += "element edge " + std::to_string(mesh.edges.size()) +
           "\nproperty int vertex1\nproperty int vertex2\n";
  out += "end_header\n";
  std::visit(
      [&](const auto& positions) {
        for (const auto value : positions) append_little(out, value);
      },
      mesh.positions);
  for (const auto& face : mesh.faces) {
    append_little(out, std::uint8_t{3});
    for (const std::int32_t v : face) append_little(out, v);
  }
  for (const auto& edge : mesh.edges)
    for (const std::int32_t v : edge) append_little(out, v);
  return out;
}

}  // namespace warmfront::client
