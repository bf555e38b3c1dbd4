// SPDX-License-Identifier: Apache-2.0
// The socket of shared memory without our library: packets of any bytes, and the memory that was received.
// Used by one thread at a time.
#pragma once

#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/wire/shared_columns.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::test {

class PacketClient {
 public:
  /// Beside the daemon's `unix:PATH`.
  explicit PacketClient(const std::string& address) {
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    const std::string path = address.substr(5) + wire::kSharedMemorySuffix;
    std::memcpy(to.sun_path, path.c_str(), path.size() + 1);
    socket_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~PacketClient() {
    close();
    if (memory_ != nullptr) ::munmap(memory_, size_);
    if (file_ >= 0) ::close(file_);
  }
  PacketClient(const PacketClient&) = delete;
  PacketClient& operator=(const PacketClient&) = delete;

  bool connected() const { return connected_; }
  void close() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }

  bool send(const std::string& packet) const {
    return ::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL) >= 0;
  }
  bool send(const v1::StreamStepsRequest& request) const { return send(request.SerializeAsString()); }

  /// The next message; none at the end, or after ten minutes: numbers of any size make long steps, and a
  /// sanitizer makes them twenty times as long.
  std::optional<v1::StreamStepsResponse> receive() {
    pollfd one{socket_, POLLIN, 0};
    if (::poll(&one, 1, 600'000) != 1) return std::nullopt;
    std::vector<char> packet(wire::kMostPacketBytes);
    iovec part{packet.data(), packet.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    ssize_t length = ::recvmsg(socket_, &message, MSG_CMSG_CLOEXEC);
    if (length < 0 && errno == ECONNRESET) length = ::recvmsg(socket_, &message, MSG_CMSG_CLOEXEC);
    if (length <= 0) return std::nullopt;
    v1::StreamStepsResponse response;
    if (!response.ParseFromArray(packet.data(), static_cast<int>(length))) return std::nullopt;
    if (const cmsghdr* header = CMSG_FIRSTHDR(&message);
        header != nullptr && header->cmsg_type == SCM_RIGHTS) {
      if (file_ >= 0) ::close(file_);
      std::memcpy(&file_, CMSG_DATA(header), sizeof file_);
      if (memory_ != nullptr) ::munmap(memory_, size_);
      size_ = response.shared_memory().bytes();
      void* mapped = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
      memory_ = mapped == MAP_FAILED ? nullptr : static_cast<char*>(mapped);
    }
    return response;
  }
  /// Nothing more comes: the daemon ended the connection.
  bool ended() { return !receive(); }

  /// True once memory came.
  bool bind(const std::string& session, const std::string& token, std::uint64_t bytes) {
    v1::StreamStepsRequest request;
    request.mutable_shared_memory()->set_session_id(session);
    request.mutable_shared_memory()->set_token(token);
    request.mutable_shared_memory()->set_bytes(bytes);
    if (!send(request)) return false;
    const auto response = receive();
    if (response && response->shared_memory().has_error()) error_ = response->shared_memory().error();
    return response && memory_ != nullptr;
  }
  const v1::Status& error() const { return error_; }

  char* memory() const { return memory_; }
  std::size_t size() const { return size_; }
  int file() const { return file_; }

 private:
  int socket_ = -1;
  bool connected_ = false;
  int file_ = -1;
  char* memory_ = nullptr;
  std::size_t size_ = 0;
  v1::Status error_;
};

}  // namespace warmfront::test
