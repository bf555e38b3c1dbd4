// SPDX-License-Identifier: Apache-2.0
// Numbers in messages. Thread-safe.
#pragma once

#include <array>
#include <charconv>
#include <string>

namespace warmfront {

/// As few digits as say the value: std::to_string() would call -1e-9 "-0.000000", and 1 + 1e-7 "1.000000".
inline std::string digits_of(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

}  // namespace warmfront
