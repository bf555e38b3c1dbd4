// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: which elements follow, how many, with which properties. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/result.h"

namespace warmfront::client {

enum class PlyFormat : std::uint8_t { kAscii, kLittleEndian, kBigEndian };
enum class PlyType : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

/// Bytes of a scalar in the binary formats.
std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  /// Set for a list: the type of its length.
  std::optional<PlyType> length_type;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Minimum size of one entry.
  std::size_t least_bytes(PlyFormat format) const;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  std::size_t data_offset = 0;  ///< first byte after the header
  std::size_t lines = 0;        ///< lines of the header

  /// The element of that name, or null.
  const PlyElement* find(std::string_view name) const;
};

/// Reads the header at the start of `bytes`; `file` names the source in errors, which say the line.
Result<PlyHeader> parse_ply_header(std::string_view bytes, std::string_view file);

}  // namespace warmfront::client
