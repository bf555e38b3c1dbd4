// SPDX-License-Identifier: Apache-2.0
// One thread forwards for all. Thread safety as stated in the header.
#include "tests/faults/switch_proxy.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <utility>

#include "proto/wire/shared_columns.h"

namespace warmfront::test {
namespace {

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  return address;
}

int new_socket() {
  return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
}

// Blocks while the other end is slow: a daemon that is frozen is cut before it has to read much.
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

SwitchProxy::SwitchProxy(std::vector<std::string> targets) : targets_(std::move(targets)) {
  listener_ = new_socket();
  const sockaddr_un own = address_of(address().substr(5));
  EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0);
  EXPECT_EQ(::listen(listener_, 128), 0);
  EXPECT_EQ(::pipe2(wake_, O_CLOEXEC), 0);
  thread_ = std::thread([this] { run(); });
}

SwitchProxy::~SwitchProxy() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake();
  thread_.join();
  close_all();
  for (const int file : {listener_, wake_[0], wake_[1]}) ::close(file);
}

std::string SwitchProxy::address() const {
  return "unix:" + (folder_.path() / "p.sock").string();
}

void SwitchProxy::wake() {
  EXPECT_EQ(::write(wake_[1], "w", 1), 1);
}

void SwitchProxy::place_link() {
  namespace fs = std::filesystem;
  const fs::path link = address().substr(5) + wire::kSharedMemorySuffix;
  fs::remove(link);
  if (shares_memory_) fs::create_symlink(targets_[target_] + wire::kSharedMemorySuffix, link);
}

void SwitchProxy::share_memory(bool shared) {
  const std::lock_guard lock(mutex_);
  shares_memory_ = shared;
  place_link();
}

void SwitchProxy::lead_to(std::size_t target) {
  std::unique_lock lock(mutex_);
  target_ = target;
  place_link();
  lose_answers_ = false;
  cut_ = true;
  wake();
  changed_.wait(lock, [this] { return !cut_; });
}

void SwitchProxy::lose_answers() {
  const std::lock_guard lock(mutex_);
  lose_answers_ = true;
}

void SwitchProxy::end_before(Way way, long n) {
  const std::lock_guard lock(mutex_);
  end_way_ = way;
  bytes_left_ = n;
  ended_ = false;
}

bool SwitchProxy::ended() {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void SwitchProxy::close_all() {
  for (const Connection& connection : std::exchange(connections_, {})) {
    ::close(connection.client);
    ::close(connection.daemon);
  }
}

void SwitchProxy::accept_one() {
  const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int daemon = new_socket();
  const sockaddr_un target = address_of(targets_[target_]);
  if (::connect(daemon, reinterpret_cast<const sockaddr*>(&target), sizeof(target)) == 0) {
    connections_.push_back({client, daemon});
    return;
  }
  ::close(daemon);
  ::close(client);
}

// False when the connection has ended.
bool SwitchProxy::forward(const Connection& connection, bool from_client) {
  std::array<char, 65536> block;
  ssize_t count = ::recv(from_client ? connection.client : connection.daemon, block.data(), block.size(), 0);
  if (count <= 0) return false;
  if (!from_client && lose_answers_) return true;
  bool ends = false;
  if (bytes_left_ >= 0 && from_client == (end_way_ == Way::kToDaemon)) {
    ends = count > bytes_left_;
    if (ends) count = bytes_left_;
    bytes_left_ = ends ? -1 : bytes_left_ - count;
    ended_ |= ends;
  }
  const int to = from_client ? connection.daemon : connection.client;
  return send_all(to, block.data(), static_cast<std::size_t>(count)) && !ends;
}

void SwitchProxy::run() {
  for (;;) {
    std::vector<pollfd> files{{wake_[0], POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Connection& connection : connections_) {
      files.push_back({connection.client, POLLIN, 0});
      files.push_back({connection.daemon, POLLIN, 0});
    }
    if (::poll(files.data(), files.size(), -1) <= 0) continue;
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    if (files[0].revents != 0) {
      char byte = 0;
      EXPECT_EQ(::read(wake_[0], &byte, 1), 1);
    }
    if (std::exchange(cut_, false)) {
      close_all();
      changed_.notify_all();
      continue;
    }
    std::vector<Connection> open;
    for (std::size_t i = 0; i < connections_.size(); ++i) {
      bool ended = false;
      for (const bool from_client : {true, false}) {
        if (!ended && files[2 + 2 * i + (from_client ? 0 : 1)].revents != 0)
          ended = !forward(connections_[i], from_client);
      }
      if (!ended) {
        open.push_back(connections_[i]);
        continue;
      }
      ::close(connections_[i].client);
      ::close(connections_[i].daemon);
    }
    connections_ = std::move(open);
    if (files[1].revents != 0) accept_one();
  }
}

}  // namespace warmfront::test
