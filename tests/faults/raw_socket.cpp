// SPDX-License-Identifier: Apache-2.0
// Sockets and frames by hand. Thread safety as stated in the header.
#include "tests/faults/raw_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace warmfront::test {

RawSocket::RawSocket(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  descriptor_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor_ >= 0 &&
      ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    ::close(descriptor_);
    descriptor_ = -1;
  }
}

RawSocket::~RawSocket() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool RawSocket::send(const std::string& bytes) const {
  for (std::size_t at = 0; at < bytes.size();) {
    pollfd ready{descriptor_, POLLOUT, 0};
    if (::poll(&ready, 1, 5000) <= 0) return false;
    const ssize_t sent =
        ::send(descriptor_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) return false;
    at += static_cast<std::size_t>(sent);
  }
  return true;
}

std::string RawSocket::read_all(int milliseconds) const {
  std::string all;
  std::array<char, 65536> block;
  for (;;) {
    pollfd ready{descriptor_, POLLIN, 0};
    if (::poll(&ready, 1, milliseconds) <= 0) return all;
    const ssize_t got = ::recv(descriptor_, block.data(), block.size(), 0);
    if (got <= 0) return all;
    all.append(block.data(), static_cast<std::size_t>(got));
  }
}

void RawSocket::reset() {
  const linger now{1, 0};
  ::setsockopt(descriptor_, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
  ::close(std::exchange(descriptor_, -1));
}

namespace http2 {

std::string frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload) {
  const auto byte = [](std::size_t value) { return static_cast<char>(value & 255); };
  std::string bytes{
      byte(payload.size() >> 16), byte(payload.size() >> 8), byte(payload.size()), byte(type),  byte(flags),
      byte(stream >> 24),         byte(stream >> 16),        byte(stream >> 8),    byte(stream)};
  return bytes.append(payload);
}

std::string hello() {
  return "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "");
}

std::string acknowledgement() {
  return frame(4, 1, 0, "");
}

namespace {

/// A length with a prefix of seven bits (RFC 7541, 5.1).
std::string length(std::size_t value) {
  if (value < 127) return {static_cast<char>(value)};
  std::string bytes{127};
  for (value -= 127; value >= 128; value >>= 7) bytes += static_cast<char>(128 | (value & 127));
  return bytes + static_cast<char>(value);
}

}  // namespace

std::string header_block(const Headers& headers) {
  std::string block;
  for (const auto& [name, value] : headers) {
    block.push_back(0);
    block.append(length(name.size())).append(name).append(length(value.size())).append(value);
  }
  return block;
}

Headers call_headers(const std::string& path, const Headers& more) {
  Headers headers{{":method", "POST"},
                  {":scheme", "http"},
                  {":path", path},
                  {":authority", "localhost"},
                  {"content-type", "application/grpc"},
                  {"te", "trailers"}};
  headers.insert(headers.end(), more.begin(), more.end());
  return headers;
}

std::string headers(std::uint32_t stream, const Headers& headers) {
  constexpr std::size_t kLargestFrame = 16384;
  constexpr std::uint8_t kEndHeaders = 4;
  const std::string block = header_block(headers);
  std::string frames;
  std::size_t at = 0;
  do {
    const std::string part = block.substr(at, kLargestFrame);
    const bool last = at + part.size() == block.size();
    frames += frame(at == 0 ? 1 : 9, last ? kEndHeaders : 0, stream, part);
    at += part.size();
  } while (at < block.size());
  return frames;
}

std::string reset_stream(std::uint32_t stream) {
  return frame(3, 0, stream, std::string("\0\0\0\x08", 4));
}
std::string ping() {
  return frame(6, 0, 0, "12345678");
}

}  // namespace http2
}  // namespace warmfront::test
