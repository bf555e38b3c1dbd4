// SPDX-License-Identifier: Apache-2.0
// Lines, words and numbers: see text.h.
#include "client/io/text.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace warmfront::client {
namespace {

// from_chars takes no leading plus, which files do have.
std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
  return word;
}

template <class T>
bool parse(std::string_view word, T& value) {
  word = without_plus(word);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  return code == std::errc() && end == word.data() + word.size();
}

template <class T, class Convert>
bool parse_real(std::string_view word, T& value, Convert convert) {
  word = without_plus(word);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return false;
  if (code == std::errc()) return true;
  if (code != std::errc::result_out_of_range) return false;
  // from_chars leaves the value alone when it overflows or underflows; the C functions give infinity or zero.
  value = convert(std::string(word).c_str(), nullptr);
  return true;
}

}  // namespace

bool LineScanner::next(std::string_view& line) {
  if (offset_ >= text_.size()) return false;
  std::size_t end = text_.find('\n', offset_);
  const bool last = end == std::string_view::npos;
  if (last) end = text_.size();
  line = text_.substr(offset_, end - offset_);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  offset_ = last ? end : end + 1;
  ++line_number_;
  return true;
}

std::string_view next_word(std::string_view& rest) {
  constexpr std::string_view kBlank = " \t\v\f\r";
  const std::size_t begin = rest.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) {
    rest = {};
    return {};
  }
  std::size_t end = rest.find_first_of(kBlank, begin);
  if (end == std::string_view::npos) end = rest.size();
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

bool parse_number(std::string_view word, double& value) {
  return parse_real(word, value, std::strtod);
}
bool parse_number(std::string_view word, float& value) {
  return parse_real(word, value, std::strtof);
}
bool parse_number(std::string_view word, std::int64_t& value) {
  return parse(word, value);
}
bool parse_number(std::string_view word, std::uint64_t& value) {
  return parse(word, value);
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "'";
  for (const char c : word.substr(0, kLongest)) text += c >= 0x20 && c < 0x7f ? c : '?';
  return text + (word.size() > kLongest ? "...'" : "'");
}

bool has_ending(std::string_view name, std::string_view ending) {
  if (name.size() < ending.size()) return false;
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(name.substr(name.size() - ending.size()), ending, {}, lower);
}

std::string csv_field(std::string_view field) {
  if (field.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(field);
  std::string quoted = "\"";
  for (const char c : field) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + "\"";
}

Error error_at_line(std::string_view file, std::size_t line, const std::string& what) {
  return invalid_argument(std::string(file) + ": line " + std::to_string(line) + ": " + what);
}

Error error_at_byte(std::string_view file, std::size_t byte, const std::string& what) {
  return invalid_argument(std::string(file) + ": byte " + std::to_string(byte) + ": " + what);
}

}  // namespace warmfront::client
