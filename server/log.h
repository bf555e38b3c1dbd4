// SPDX-License-Identifier: Apache-2.0
// The daemon's log: one event a line, as text or as JSON. Thread-safe.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>
#include <variant>

namespace warmfront::server {

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError, kOff };
enum class LogFormat : std::uint8_t { kText, kJson };

/// A named value of an event.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::int64_t, std::uint64_t, double, bool> value;
};

/// Text: `2026-01-31T12:00:00.000Z info session_created session=... vertices=...`; a value with blanks or
/// quotes is quoted as in JSON. JSON:
/// `{"time":"...","level":"info","event":"session_created","session":"...","vertices":...}`.
class Log {
 public:
  /// Writes to `out`, or to standard error when null. `out` outlives the log.
  Log(LogLevel level, LogFormat format, std::ostream* out = nullptr);
  ~Log();

  /// `event` is a word in snake_case.
  void write(LogLevel level, std::string_view event, std::initializer_list<LogField> fields = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront::server
