// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/trace_context.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace warmfront::wire {
namespace {

/// The value of a lower-case digit; none for another character.
std::optional<std::uint8_t> digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<std::uint8_t>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<std::uint8_t>(c - 'a' + 10);
  return std::nullopt;
}

bool read_bytes(std::string_view text, std::span<std::uint8_t> bytes) {
  if (text.size() != 2 * bytes.size()) return false;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::optional<std::uint8_t> high = digit(text[2 * i]), low = digit(text[2 * i + 1]);
    if (!high || !low) return false;
    bytes[i] = static_cast<std::uint8_t>(*high << 4 | *low);
  }
  return true;
}

bool is_zero(std::span<const std::uint8_t> bytes) {
  return std::ranges::all_of(bytes, [](std::uint8_t byte) { return byte == 0; });
}

/// What a later version may have behind the fields that are known.
bool is_more(std::string_view text) {
  return text.starts_with('-') && std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

std::optional<TraceContext> TraceContext::parse(std::string_view traceparent) {
  constexpr std::uint8_t kNoVersion = 0xff;
  if (traceparent.size() < kTraceparentLength || traceparent[2] != '-' || traceparent[35] != '-' ||
      traceparent[52] != '-')
    return std::nullopt;
  const std::string_view more = traceparent.substr(kTraceparentLength);
  TraceContext context;
  std::array<std::uint8_t, 1> version{}, flags{};
  if (!read_bytes(traceparent.substr(0, 2), version) || version[0] == kNoVersion ||
      !(more.empty() || (version[0] > 0 && is_more(more))) ||
      !read_bytes(traceparent.substr(3, 32), context.trace) ||
      !read_bytes(traceparent.substr(36, 16), context.parent) ||
      !read_bytes(traceparent.substr(53, 2), flags) || is_zero(context.trace) || is_zero(context.parent))
    return std::nullopt;
  context.sampled = (flags[0] & 1U) != 0;
  return context;
}

}  // namespace warmfront::wire
