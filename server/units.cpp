// SPDX-License-Identifier: Apache-2.0
// Numbers with units. Thread-safe.
#include "server/units.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <utility>

namespace warmfront::server {
namespace {

using Unit = std::pair<std::string_view, std::uint64_t>;
constexpr std::array<Unit, 4> kBytes{{{"GiB", 1 << 30}, {"MiB", 1 << 20}, {"KiB", 1 << 10}, {"", 1}}};
constexpr std::array<Unit, 4> kTimes{{{"h", 3'600'000}, {"m", 60'000}, {"s", 1000}, {"ms", 1}}};

Error out_of_range(std::string_view text, const std::string& expected) {
  return invalid_argument('"' + std::string(text) + "\": " + expected + " is expected");
}

/// The number with one of the units, in the smallest unit; in [least, most].
Result<std::uint64_t> parse_scaled(std::string_view text, const std::array<Unit, 4>& units,
                                   std::uint64_t least, std::uint64_t most, const std::string& expected) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return out_of_range(text, expected);
  const std::string_view suffix(end, static_cast<std::size_t>(text.data() + text.size() - end));
  for (const auto& [name, scale] : units) {
    if (suffix != name) continue;
    if (number > most / scale || number * scale < least) break;
    return number * scale;
  }
  return out_of_range(text, expected);
}

std::string format_scaled(std::uint64_t value, const std::array<Unit, 4>& units) {
  for (const auto& [name, scale] : units)
    if (value != 0 && value % scale == 0) return std::to_string(value / scale) + std::string(name);
  return std::to_string(value) + std::string(units.back().first);
}

}  // namespace

Result<std::uint64_t> parse_integer(std::string_view text, std::uint64_t least, std::uint64_t most) {
  constexpr std::array<Unit, 4> kNone{{{"", 1}, {"", 1}, {"", 1}, {"", 1}}};
  return parse_scaled(text, kNone, least, most,
                      "an integer in [" + std::to_string(least) + ", " + std::to_string(most) + "]");
}

Result<std::uint64_t> parse_bytes(std::string_view text, std::uint64_t least) {
  return parse_scaled(text, kBytes, least, std::uint64_t{1} << 60,
                      "a size of at least " + format_bytes(least) + " such as 1048576, 64KiB, 32MiB or 1GiB");
}

Result<std::chrono::milliseconds> parse_duration(std::string_view text) {
  const Result<std::uint64_t> ms =
      parse_scaled(text, kTimes, 1, 3'600'000'000, "a time of at most 1000h such as 250ms, 30s, 10m or 1h");
  if (!ms) return ms.error();
  return std::chrono::milliseconds(ms.value());
}

std::string format_bytes(std::uint64_t bytes) {
  return format_scaled(bytes, kBytes);
}

std::string describe_bytes(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kNames{"bytes", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1024 && unit + 1 < kNames.size(); ++unit) value /= 1024;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), unit == 0 ? "%.0f %s" : "%.1f %s", value, kNames[unit]);
  return text.data();
}

std::string format_duration(std::chrono::milliseconds duration) {
  return format_scaled(static_cast<std::uint64_t>(duration.count()), kTimes);
}

}  // namespace warmfront::server
