// SPDX-License-Identifier: Apache-2.0
// Lines, words and numbers of text formats. Pure functions and values; nothing here depends on the locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "engine/result.h"

namespace warmfront::client {

/// Iterates over the lines of a text, ended by LF or CR LF; the last one may have no end.
class LineScanner {
 public:
  explicit LineScanner(std::string_view text) : text_(text) {}

  /// The next line without its end. False after the last one.
  bool next(std::string_view& line);

  /// Number of the line last given, from 1.
  std::size_t line_number() const { return line_number_; }
  /// Bytes consumed so far.
  std::size_t offset() const { return offset_; }

 private:
  std::string_view text_;
  std::size_t offset_ = 0;
  std::size_t line_number_ = 0;
};

/// Cuts the first word (no blanks, no tabs) off `rest`. Empty when there is none.
std::string_view next_word(std::string_view& rest);

/// Parses all of `word`, rounded to nearest; "nan" and "inf" are numbers, and overflow or underflow gives
/// infinity or zero. False when `word` is not a number.
bool parse_number(std::string_view word, double& value);
bool parse_number(std::string_view word, float& value);
bool parse_number(std::string_view word, std::int64_t& value);
bool parse_number(std::string_view word, std::uint64_t& value);

/// `word` in quotes for error messages, truncated and with control characters replaced.
std::string in_quotes(std::string_view word);

/// `field` as one field of a CSV file: in double quotes where it needs them.
std::string csv_field(std::string_view field);

/// Whether the name ends so, in any case; `ending` is in lower case.
bool has_ending(std::string_view name, std::string_view ending);

/// "FILE: line N: WHAT" and "FILE: byte N: WHAT".
Error error_at_line(std::string_view file, std::size_t line, const std::string& what);
Error error_at_byte(std::string_view file, std::size_t byte, const std::string& what);

}  // namespace warmfront::client
