// SPDX-License-Identifier: Apache-2.0
// The log's two formats over spdlog. Thread safety as stated in the header.
#include "server/log.h"

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace warmfront::server {
namespace {

using Json = nlohmann::ordered_json;

spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
    case LogLevel::kOff:
      break;
  }
  return spdlog::level::off;
}

/// JSON of a value. Text that is no UTF-8 comes out with replacement characters: a log line is never refused.
std::string dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json json_of(const LogField& field) {
  return std::visit([](const auto& value) { return Json(value); }, field.value);
}

std::string text_line(std::string_view event, std::initializer_list<LogField> fields) {
  std::string line(event);
  for (const LogField& field : fields) {
    const Json value = json_of(field);
    const auto* text = std::get_if<std::string>(&field.value);
    const bool plain = text != nullptr && !text->empty() &&
                       std::all_of(text->begin(), text->end(),
                                   [](char c) { return c > ' ' && c < '\x7f' && c != '"' && c != '\\'; });
    line.append(" ").append(field.name).append("=").append(plain ? *text : dump(value));
  }
  return line;
}

/// The members of an object, without its braces: the pattern puts time and level before them. One value at a
/// time, because an object of this library needs memory to be destroyed, and ends the process where there is
/// none.
std::string json_line(std::string_view event, std::initializer_list<LogField> fields) {
  std::string line = "\"event\":" + dump(Json(event));
  for (const LogField& field : fields)
    line.append(",\"").append(field.name).append("\":").append(dump(json_of(field)));
  return line;
}

}  // namespace

struct Log::Impl {
  LogFormat format;
  spdlog::logger logger;
};

Log::Log(LogLevel level, LogFormat format, std::ostream* out) {
  spdlog::sink_ptr sink;
  if (out != nullptr)
    sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(*out, true);
  else
    sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  impl_ = std::make_unique<Impl>(Impl{format, spdlog::logger("warmfrontd", std::move(sink))});
  const char* pattern = format == LogFormat::kText ? "%Y-%m-%dT%H:%M:%S.%eZ %l %v"
                                                   : R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})";
  impl_->logger.set_pattern(pattern, spdlog::pattern_time_type::utc);
  impl_->logger.set_level(spdlog_level(level));
  impl_->logger.flush_on(spdlog::level::debug);
}

Log::~Log() = default;

void Log::write(LogLevel level, std::string_view event, std::initializer_list<LogField> fields) {
  const spdlog::level::level_enum severity = spdlog_level(level);
  if (!impl_->logger.should_log(severity)) return;
  // The line is an argument, never the format: braces in it mean nothing.
  impl_->logger.log(severity, "{}",
                    impl_->format == LogFormat::kText ? text_line(event, fields) : json_line(event, fields));
}

}  // namespace warmfront::server
