// SPDX-License-Identifier: Apache-2.0
// Checks of listening addresses. Thread-safe.
#include "server/process/listen.h"

#include <netdb.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>

namespace warmfront::server {
namespace {

constexpr std::string_view kUnix = "unix:";

sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

/// The host of HOST:PORT or [HOST]:PORT; empty when the text has another shape.
std::string host_of(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return {};
  int port = -1;
  const char* last = address.data() + address.size();
  const auto [end, error] = std::from_chars(address.data() + colon + 1, last, port);
  if (error != std::errc() || end != last || port < 0 || port > 65535) return {};
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') return host.substr(1, host.size() - 2);
  return host.find(':') == std::string::npos ? host : std::string{};
}

std::string port_of(const std::string& address) {
  return address.substr(address.rfind(':') + 1);
}

/// Empty when it is bound, and free again.
std::string try_to_bind(int family, const sockaddr* address, socklen_t length) {
  const int socket = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return std::strerror(errno);
  const int on = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  const bool bound = ::bind(socket, address, length) == 0 && ::listen(socket, 1) == 0;
  std::string why = bound ? "" : std::strerror(errno);
  ::close(socket);
  return why;
}

std::string why_not_bound_unix(const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) == 0) {
    if (S_ISSOCK(found.st_mode)) return {};  // gRPC puts its own in its place
    return "something that is no socket has this name";
  }
  const sockaddr_un address = unix_address(path);
  std::string why = try_to_bind(AF_UNIX, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  if (why.empty()) ::unlink(path.c_str());
  return why;
}

std::string why_not_bound_tcp(const std::string& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host_of(address).c_str(), port_of(address).c_str(), &hints, &found);
      error != 0)
    return ::gai_strerror(error);
  std::string why;
  for (const addrinfo* one = found; one != nullptr && why.empty(); one = one->ai_next)
    why = try_to_bind(one->ai_family, one->ai_addr, one->ai_addrlen);
  ::freeaddrinfo(found);
  return why;
}

/// 127.x.y.z and nothing else: a name such as 127.example.org may point anywhere.
bool is_loopback_ipv4(const std::string& host) {
  return host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos;
}

}  // namespace

bool is_host_and_port(const std::string& address) {
  return !host_of(address).empty();
}

bool someone_listens(const std::string& path) {
  const sockaddr_un address = unix_address(path);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return false;
  const bool connected = ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  ::close(socket);
  return connected;
}

std::optional<std::string> unix_path(const std::string& address) {
  if (!address.starts_with(kUnix)) return std::nullopt;
  return address.substr(kUnix.size());
}

bool is_local(const std::string& address) {
  if (address.starts_with(kUnix)) return true;
  const std::string host = host_of(address);
  return host == "localhost" || host == "::1" || is_loopback_ipv4(host);
}

Status check_listen_address(const std::string& address, bool secured) {
  if (address.starts_with(kUnix)) {
    const std::string path = address.substr(kUnix.size());
    if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path))
      return invalid_argument("listen " + address + ": a path of 1 to " +
                              std::to_string(sizeof(sockaddr_un::sun_path) - 1) + " bytes is expected");
    return {};
  }
  if (!is_host_and_port(address))
    return invalid_argument(
        "listen " + address +
        ": HOST:PORT (an IPv6 host in brackets) or unix:PATH is expected, the port in [0, 65535]");
  if (!is_local(address) && !secured)
    return invalid_argument(
        "listen " + address +
        ": others can reach this address and nothing is encrypted or authenticated; set --tls-cert and "
        "--tls-key, listen on 127.0.0.1 or unix:PATH behind a proxy, or state --insecure");
  return {};
}

std::string why_not_bound(const std::string& address) {
  const std::string why = address.starts_with(kUnix) ? why_not_bound_unix(address.substr(kUnix.size()))
                                                     : why_not_bound_tcp(address);
  return "cannot be bound: " +
         (why.empty() ? "it could be just now; was it in use, or is it listed twice?" : why);
}

}  // namespace warmfront::server
