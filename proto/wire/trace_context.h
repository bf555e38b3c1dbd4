// SPDX-License-Identifier: Apache-2.0
// What a caller says of the trace that its call is part of: the metadata `traceparent` of W3C Trace Context.
// Plain values; thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace warmfront::wire {

using TraceId = std::array<std::uint8_t, 16>;
using SpanId = std::array<std::uint8_t, 8>;

/// What a traceparent that cannot be read should have been.
inline constexpr const char* kTraceparentExpected =
    "00-TRACE-SPAN-FLAGS of W3C Trace Context is expected, 32, 16 and 2 lower-case hexadecimal digits, no id "
    "of zeros alone";

/// So long is what every version begins with, and all of version 00.
inline constexpr std::size_t kTraceparentLength = 55;

struct TraceContext {
  TraceId trace{};
  SpanId parent{};  ///< the caller's span
  bool sampled = false;

  /// `00-<trace>-<parent>-<flags>` in lower-case hexadecimal digits, and what begins so and has a later
  /// version, with or without more behind another `-`; none for anything else, and for ids of zeros alone
  /// (W3C Trace Context, sections 3.2.2 and 4.3, Versioning of traceparent).
  static std::optional<TraceContext> parse(std::string_view traceparent);
};

}  // namespace warmfront::wire
