// SPDX-License-Identifier: Apache-2.0
// One thread a connection. Thread safety as stated in the header.
#include "tests/unit/server/switchboard.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>

namespace warmfront::test {
namespace {

/// How soon a connection notices that it is to be cut, where nothing comes.
constexpr int kGlanceMs = 5;

int unix_socket(const std::string& path, sockaddr_un& address) {
  address = {};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
}

int connect_to(const std::string& to) {
  sockaddr_un address;
  const int connection = unix_socket(to.substr(to.find(':') + 1), address);
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

}  // namespace

Switchboard::Switchboard(const std::string& to) : to_(to) {
  sockaddr_un address;
  listener_ = unix_socket(path_, address);
  EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  EXPECT_EQ(::listen(listener_, 128), 0);
  acceptor_ = std::thread([this] { accept_all(); });
}

Switchboard::~Switchboard() {
  stopping_ = true;
  acceptor_.join();
  for (std::thread& forwarder : forwarders_) forwarder.join();
  ::close(listener_);
}

void Switchboard::lead_to(const std::string& to) {
  const std::lock_guard lock(mutex_);
  to_ = to;
  losing_ = false;
  ++epoch_;
}

void Switchboard::accept_all() {
  while (!stopping_) {
    pollfd ready{listener_, POLLIN, 0};
    if (::poll(&ready, 1, kGlanceMs) <= 0) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const std::lock_guard lock(mutex_);
    forwarders_.emplace_back([this, client, to = to_, epoch = epoch_.load()] { forward(client, to, epoch); });
  }
}

void Switchboard::forward(int client, const std::string& to, unsigned epoch) {
  const int daemon = connect_to(to);
  std::array<char, 65536> block;
  for (bool open = daemon >= 0; open && !stopping_ && epoch == epoch_;) {
    std::array<pollfd, 2> ready{{{client, POLLIN, 0}, {daemon, POLLIN, 0}}};
    if (::poll(ready.data(), ready.size(), kGlanceMs) <= 0) continue;
    for (int side = 0; open && side < 2; ++side) {
      if (ready[side].revents == 0) continue;
      const ssize_t got = ::recv(side == 0 ? client : daemon, block.data(), block.size(), 0);
      // What came before a cut is not delivered after it.
      open = got > 0 && epoch == epoch_;
      if (open && !(side == 1 && losing_))
        open = send_all(side == 0 ? daemon : client, block.data(), static_cast<std::size_t>(got));
    }
  }
  ::close(client);
  if (daemon >= 0) ::close(daemon);
}

}  // namespace warmfront::test
