// SPDX-License-Identifier: Apache-2.0
// Sizes and times as people write them. Thread-safe.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "engine/result.h"

namespace warmfront::server {

/// A decimal integer in [least, most].
Result<std::uint64_t> parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most);
/// "1048576", "64KiB", "32MiB", "1GiB"; in [least, 2^60].
Result<std::uint64_t> parse_bytes(std::string_view text, std::uint64_t least);
/// "250ms", "30s", "10m", "1h"; in [1 ms, 1000 h].
Result<std::chrono::milliseconds> parse_duration(std::string_view text);

/// In the largest unit that is exact, so that parsing it gives the same value.
std::string format_bytes(std::uint64_t bytes);
/// Rounded, for messages: "1.5 MiB".
std::string describe_bytes(std::uint64_t bytes);
std::string format_duration(std::chrono::milliseconds duration);

}  // namespace warmfront::server
