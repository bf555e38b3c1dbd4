// SPDX-License-Identifier: Apache-2.0
// One thread a connection. Thread safety as stated in the header.
#include "tests/soak/chaos_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <random>
#include <utility>

namespace warmfront::test {
namespace {

constexpr int kGlanceMs = 100;

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  const int connection = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0)
    return connection;
  ::close(connection);
  return -1;
}

bool send_all(int to, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t sent = ::send(to, bytes, count, MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes += sent;
    count -= static_cast<std::size_t>(sent);
  }
  return true;
}

void reset_at_close(int connection) {
  const linger now{1, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
}

/// A daemon that is stopped in the middle of a transfer must not hold up the end of the test.
void give_up_after_a_while(int connection) {
  const timeval limit{5, 0};
  ::setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
}

}  // namespace

ChaosProxy::ChaosProxy(std::string path, std::uint64_t seed) : path_(std::move(path)), seed_(seed) {
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), length);
  ::listen(listener_, 128);
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  acceptor_ = std::thread([this] { accept_all(); });
}

ChaosProxy::~ChaosProxy() {
  stopping_ = true;
  acceptor_.join();
  for (std::thread& forwarder : forwarders_) forwarder.join();
  ::close(listener_);
}

void ChaosProxy::accept_all() {
  for (std::uint64_t number = 0; !stopping_;) {
    pollfd ready{listener_, POLLIN, 0};
    if (::poll(&ready, 1, kGlanceMs) <= 0) continue;
    // Not for the daemons that are started meanwhile: one would keep open what is closed here.
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    ++counts_.connections;
    forwarders_.emplace_back([this, client, seed = seed_ + ++number] { forward(client, seed); });
  }
}

void ChaosProxy::forward(int client, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto one_in = [&](std::uint64_t n) { return !behaving_ && random() % n == 0; };
  const int daemon = connect_to(path_);
  give_up_after_a_while(client);
  if (daemon >= 0) give_up_after_a_while(daemon);
  std::array<char, 16384> block;
  for (bool open = daemon >= 0; open && !stopping_;) {
    std::array<pollfd, 2> ready{{{client, POLLIN, 0}, {daemon, POLLIN, 0}}};
    if (::poll(ready.data(), ready.size(), kGlanceMs) <= 0) continue;
    for (int side = 0; open && side < 2; ++side) {
      if (ready[side].revents == 0) continue;
      const int from = side == 0 ? client : daemon, to = side == 0 ? daemon : client;
      const ssize_t got = ::recv(from, block.data(), block.size(), 0);
      if (got <= 0) {
        open = false;
        break;
      }
      auto count = static_cast<std::size_t>(got);
      if (one_in(40)) {
        ++counts_.delays;
        std::this_thread::sleep_for(std::chrono::milliseconds(1 + random() % 60));
      }
      const bool cut = one_in(1500), reset = one_in(1500);
      if (cut || reset) {
        count = random() % count;  // in the middle of a message, most likely
        open = false;
        ++(reset ? counts_.resets : counts_.cuts);
        if (reset) reset_at_close(client);
      }
      if (!send_all(to, block.data(), count)) open = false;
      counts_.bytes += count;
    }
  }
  ::close(client);
  if (daemon >= 0) ::close(daemon);
}

}  // namespace warmfront::test
