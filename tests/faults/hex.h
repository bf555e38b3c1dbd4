// SPDX-License-Identifier: Apache-2.0
// Arrays as hexadecimal text of their bytes, so that no bit is lost. Pure functions.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace warmfront::test {

template <class T>
std::string hex(const T* values, std::size_t count) {
  static const char* const digits = "0123456789abcdef";
  const auto* bytes = reinterpret_cast<const unsigned char*>(values);
  std::string text;
  for (std::size_t i = 0; i < count * sizeof(T); ++i) {
    text += digits[bytes[i] >> 4];
    text += digits[bytes[i] & 15];
  }
  return text;
}
template <class T>
std::string hex(const std::vector<T>& values) {
  return hex(values.data(), values.size());
}

template <class T>
std::vector<T> from_hex(const std::string& text) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  std::string bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes += static_cast<char>(digit(text[i]) * 16 + digit(text[i + 1]));
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty())
    std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(T));
  return values;
}

}  // namespace warmfront::test
