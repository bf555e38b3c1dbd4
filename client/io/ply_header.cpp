// SPDX-License-Identifier: Apache-2.0
// The PLY header: see ply_header.h.
#include "client/io/ply_header.h"

#include <array>
#include <utility>

#include "client/io/text.h"

namespace warmfront::client {
namespace {

std::optional<PlyType> parse_type(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames{{{"char", PlyType::kInt8},
                                                                         {"int8", PlyType::kInt8},
                                                                         {"uchar", PlyType::kUint8},
                                                                         {"uint8", PlyType::kUint8},
                                                                         {"short", PlyType::kInt16},
                                                                         {"int16", PlyType::kInt16},
                                                                         {"ushort", PlyType::kUint16},
                                                                         {"uint16", PlyType::kUint16},
                                                                         {"int", PlyType::kInt32},
                                                                         {"int32", PlyType::kInt32},
                                                                         {"uint", PlyType::kUint32},
                                                                         {"uint32", PlyType::kUint32},
                                                                         {"float", PlyType::kFloat32},
                                                                         {"float32", PlyType::kFloat32},
                                                                         {"double", PlyType::kFloat64},
                                                                         {"float64", PlyType::kFloat64}}};
  for (const auto& [known, type] : kNames)
    if (known == name) return type;
  return std::nullopt;
}

/// Reads "[list LENGTH] TYPE NAME"; what is wrong, or nothing.
std::optional<std::string> parse_property(std::string_view rest, PlyProperty& property) {
  std::string_view word = next_word(rest);
  if (word == "list") {
    word = next_word(rest);
    property.length_type = parse_type(word);
    if (!property.length_type) return "unknown type of a list's length " + in_quotes(word);
    word = next_word(rest);
  }
  const std::optional<PlyType> type = parse_type(word);
  if (!type) return "unknown property type " + in_quotes(word);
  property.type = *type;
  property.name = next_word(rest);
  if (property.name.empty()) return "a property without a name";
  if (!next_word(rest).empty()) return "words after the name of property " + in_quotes(property.name);
  return std::nullopt;
}

std::optional<std::string> parse_element(std::string_view rest, PlyHeader& header) {
  PlyElement element;
  element.name = next_word(rest);
  if (element.name.empty()) return "an element without a name";
  const std::string_view count = next_word(rest);
  if (!parse_number(count, element.count))
    return "element " + in_quotes(element.name) + " has no count but " + in_quotes(count);
  if (header.find(element.name)) return "element " + in_quotes(element.name) + " twice";
  header.elements.push_back(std::move(element));
  return std::nullopt;
}

std::optional<std::string> parse_format(std::string_view rest, std::optional<PlyFormat>& format) {
  if (format) return "a second format line";
  const std::string_view name = next_word(rest);
  if (name == "ascii")
    format = PlyFormat::kAscii;
  else if (name == "binary_little_endian")
    format = PlyFormat::kLittleEndian;
  else if (name == "binary_big_endian")
    format = PlyFormat::kBigEndian;
  else
    return "unknown format " + in_quotes(name);
  const std::string_view version = next_word(rest);
  if (version != "1.0") return "unknown PLY version " + in_quotes(version);
  return std::nullopt;
}

}  // namespace

std::size_t size_of(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::size_t PlyElement::least_bytes(PlyFormat format) const {
  // Text: a digit and a blank or line end each.
  if (format == PlyFormat::kAscii) return 2 * properties.size();
  std::size_t bytes = 0;
  for (const PlyProperty& property : properties)
    bytes += size_of(property.length_type.value_or(property.type));
  return bytes;
}

const PlyElement* PlyHeader::find(std::string_view name) const {
  for (const PlyElement& element : elements)
    if (element.name == name) return &element;
  return nullptr;
}

Result<PlyHeader> parse_ply_header(std::string_view bytes, std::string_view file) {
  LineScanner lines(bytes);
  std::string_view line;
  if (!lines.next(line) || line != "ply")
    return error_at_line(file, 1, "not a PLY file: it must start with 'ply'");

  PlyHeader header;
  std::optional<PlyFormat> format;
  while (lines.next(line)) {
    std::string_view rest = line;
    const std::string_view keyword = next_word(rest);
    std::optional<std::string> problem;
    if (keyword == "end_header") {
      if (!format) return error_at_line(file, lines.line_number(), "the header has no format line");
      header.format = *format;
      header.data_offset = lines.offset();
      header.lines = lines.line_number();
      return header;
    }
    if (keyword == "format") {
      problem = parse_format(rest, format);
    } else if (keyword == "element") {
      problem = parse_element(rest, header);
    } else if (keyword == "property") {
      if (header.elements.empty()) {
        problem = "a property before the first element";
      } else {
        PlyProperty property;
        problem = parse_property(rest, property);
        header.elements.back().properties.push_back(std::move(property));
      }
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      problem = "unknown header keyword " + in_quotes(keyword);
    }
    if (problem) return error_at_line(file, lines.line_number(), *problem);
  }
  return error_at_line(file, lines.line_number(), "the file ends within the header (no end_header)");
}

}  // namespace warmfront::client
