// SPDX-License-Identifier: Apache-2.0
// The scalars of a PLY file's body, one after the other, whatever its format. Used by one thread at a time.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "client/io/endian.h"
#include "client/io/ply_header.h"
#include "client/io/text.h"

namespace warmfront::client {

/// Scalars of a binary body.
class BinarySource {
 public:
  BinarySource(std::string_view bytes, const PlyHeader& header, std::string_view file)
      : bytes_(bytes),
        offset_(header.data_offset),
        order_(header.format == PlyFormat::kBigEndian ? std::endian::big : std::endian::little),
        file_(file) {}

  std::size_t remaining() const { return bytes_.size() - offset_; }
  bool begin_entry() { return true; }
  bool end_entry() { return true; }

  bool read(PlyType type, double& value) {
    if (remaining() < size_of(type)) return false;
    const char* at = bytes_.data() + offset_;
    switch (type) {
      case PlyType::kInt8:
        value = load_scalar<std::int8_t>(at, order_);
        break;
      case PlyType::kUint8:
        value = load_scalar<std::uint8_t>(at, order_);
        break;
      case PlyType::kInt16:
        value = load_scalar<std::int16_t>(at, order_);
        break;
      case PlyType::kUint16:
        value = load_scalar<std::uint16_t>(at, order_);
        break;
      case PlyType::kInt32:
        value = load_scalar<std::int32_t>(at, order_);
        break;
      case PlyType::kUint32:
        value = load_scalar<std::uint32_t>(at, order_);
        break;
      case PlyType::kFloat32:
        value = load_scalar<float>(at, order_);
        break;
      case PlyType::kFloat64:
        value = load_scalar<double>(at, order_);
        break;
    }
    offset_ += size_of(type);
    return true;
  }

  std::size_t line() const { return 0; }
  std::string problem() const { return "the file ends here"; }
  Error error(const std::string& what) const { return error_at_byte(file_, offset_, what); }

 private:
  std::string_view bytes_;
  std::size_t offset_;
  std::endian order_;
  std::string_view file_;
};

/// Scalars of an ASCII body: one entry a line, blank lines skipped.
class AsciiSource {
 public:
  AsciiSource(std::string_view bytes, const PlyHeader& header, std::string_view file)
      : body_(bytes.substr(header.data_offset)), lines_(body_), header_lines_(header.lines), file_(file) {}

  std::size_t remaining() const { return body_.size() - lines_.offset() + 1; }

  bool begin_entry() {
    problem_ = "the file ends here";
    while (lines_.next(line_)) {
      std::string_view probe = line_;
      if (!next_word(probe).empty()) return true;
    }
    return false;
  }

  bool read(PlyType type, double& value) {
    const std::string_view word = next_word(line_);
    if (word.empty()) {
      problem_ = "too few values on the line";
      return false;
    }
    // Directly to float: via double it would be rounded twice.
    float single = 0;
    const bool good = type == PlyType::kFloat32 ? parse_number(word, single) : parse_number(word, value);
    if (type == PlyType::kFloat32) value = single;
    if (!good) problem_ = in_quotes(word) + " is no number";
    return good;
  }

  bool end_entry() {
    const std::string_view word = next_word(line_);
    if (!word.empty()) problem_ = "more values on the line than the header says, from " + in_quotes(word);
    return word.empty();
  }

  std::size_t line() const { return header_lines_ + lines_.line_number(); }
  const std::string& problem() const { return problem_; }
  Error error(const std::string& what) const {
    return error_at_line(file_, header_lines_ + lines_.line_number(), what);
  }

 private:
  std::string_view body_;
  LineScanner lines_;
  std::size_t header_lines_;
  std::string_view file_;
  std::string_view line_;
  std::string problem_;
};

}  // namespace warmfront::client
