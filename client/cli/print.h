// SPDX-License-Identifier: Apache-2.0
// printf into a string. Pure function.
#pragma once

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

}  // namespace warmfront::client
