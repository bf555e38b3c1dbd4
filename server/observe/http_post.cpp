// SPDX-License-Identifier: Apache-2.0
#include "server/observe/http_post.h"

#include <civetweb.h>

#include <array>
#include <charconv>
#include <memory>

namespace warmfront::server {

Result<HttpTarget> HttpTarget::parse(std::string_view url) {
  constexpr std::string_view kScheme = "http://";
  const auto refused = [&] {
    return invalid_argument(std::string(url) +
                            ": http://HOST[:PORT]/v1/traces is expected (port 4318 unless given); for an "
                            "encrypted collector, run one beside the "
                            "daemon that sends on");
  };
  if (!url.starts_with(kScheme)) return refused();
  const std::string_view rest = url.substr(kScheme.size());
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos) return refused();
  std::string_view host = rest.substr(0, slash);
  int port = 4318;
  if (const std::size_t colon = host.rfind(':'); colon != std::string_view::npos && !host.ends_with(']')) {
    const std::string_view digits = host.substr(colon + 1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    if (error != std::errc() || end != digits.data() + digits.size() || port < 1 || port > 65535)
      return refused();
    host = host.substr(0, colon);
  }
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  if (host.empty()) return refused();
  return HttpTarget{std::string(host), port, std::string(rest.substr(slash))};
}

std::optional<std::string> http_post(const HttpTarget& target, std::string_view type, std::string_view body) {
  constexpr int kTimeoutMs = 10'000;
  std::array<char, 256> error{};
  const auto close = [](mg_connection* connection) { mg_close_connection(connection); };
  const std::unique_ptr<mg_connection, decltype(close)> connection(
      mg_connect_client(target.host.c_str(), target.port, 0, error.data(), error.size()), close);
  if (connection == nullptr) return std::string(error.data());
  mg_printf(connection.get(),
            "POST %s HTTP/1.1\r\nHost: %s:%d\r\nContent-Type: %.*s\r\nContent-Length: %zu\r\nConnection: "
            "close\r\n\r\n",
            target.path.c_str(), target.host.c_str(), target.port, static_cast<int>(type.size()), type.data(),
            body.size());
  if (mg_write(connection.get(), body.data(), body.size()) != static_cast<int>(body.size()))
    return "the connection was lost";
  if (mg_get_response(connection.get(), error.data(), error.size(), kTimeoutMs) < 0)
    return std::string(error.data());
  const mg_response_info* response = mg_get_response_info(connection.get());
  const int status = response != nullptr ? response->status_code : 0;
  if (status / 100 == 2) return std::nullopt;
  return "HTTP status " + std::to_string(status);
}

}  // namespace warmfront::server
