// SPDX-License-Identifier: Apache-2.0
#include "client/lib/address.h"

#include <charconv>
#include <filesystem>
#include <system_error>

namespace warmfront::client {
namespace {

constexpr std::string_view kUnix = "unix:";
constexpr std::size_t kLongestPath = 107;  // of a Unix socket: sockaddr_un

}  // namespace

bool is_server_address(std::string_view text) {
  if (text.starts_with(kUnix))
    return text.size() > kUnix.size() && text.size() <= kUnix.size() + kLongestPath;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const std::string_view host = text.substr(0, colon);
  if (host.find(':') != std::string_view::npos && !(host.starts_with('[') && host.ends_with(']')))
    return false;
  int port = 0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data() + colon + 1, last, port);
  return error == std::errc() && end == last && port >= 1 && port <= 65535;
}

std::optional<std::string> missing_folder(std::string_view address) {
  if (!address.starts_with(kUnix)) return std::nullopt;
  const std::filesystem::path folder = std::filesystem::path(address.substr(kUnix.size())).parent_path();
  std::error_code ignored;
  if (folder.empty() || std::filesystem::exists(folder, ignored) || ignored) return std::nullopt;
  return folder.string();
}

}  // namespace warmfront::client
