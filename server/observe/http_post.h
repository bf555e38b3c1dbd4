// SPDX-License-Identifier: Apache-2.0
// Sending over plain HTTP, by CivetWeb. Thread-safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "engine/result.h"

namespace warmfront::server {

struct HttpTarget {
  std::string host;
  int port;
  std::string path;

  /// `http://HOST[:PORT]/PATH`, the port 4318 (OTLP's) unless given; kInvalidArgument for anything else.
  static Result<HttpTarget> parse(std::string_view url);
};

/// Why the body was not taken; none if it was (a status of 2xx). Waits ten seconds at most for an answer.
std::optional<std::string> http_post(const HttpTarget& target, std::string_view type, std::string_view body);

}  // namespace warmfront::server
