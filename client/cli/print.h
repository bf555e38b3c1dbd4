// SPDX-License-Identifier: Apache-2.0
// printf into a string, and counts in words. Pure functions.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace warmfront::client {

/// As printf, into a string of at most 511 characters.
template <class... Values>
std::string print(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// "1 contact", "2 contacts".
inline std::string counted(std::uint64_t count, const char* thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

}  // namespace warmfront::client
