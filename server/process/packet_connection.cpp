// SPDX-License-Identifier: Apache-2.0
// Armed in epoll(7) for one event at a time, so that one thread at most tells of it. Thread safety as stated
// in the header.
#include "server/process/packet_connection.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace warmfront::server {

bool arm_in_epoll(int poll, int operation, int file, std::uint32_t events, std::uint64_t which) noexcept {
  epoll_event event{};
  event.events = events;
  event.data.u64 = which;
  return ::epoll_ctl(poll, operation, file, &event) == 0;
}

PacketConnection::PacketConnection(int file, std::shared_ptr<const int> poll)
    : file_(file), poll_(std::move(poll)) {}

PacketConnection::~PacketConnection() {
  ::close(file_);
}

PacketConnection::Sent PacketConnection::send(std::span<const std::string_view> pieces, int file) noexcept {
  std::array<iovec, 16> parts;
  if (pieces.size() > parts.size()) return Sent::kLost;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    parts[i] = {const_cast<char*>(pieces[i].data()), pieces[i].size()};
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = pieces.size();
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  if (file >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(header), &file, sizeof file);
  }
  for (;;) {
    if (::sendmsg(file_, &message, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) return Sent::kWhole;
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != ENOBUFS) return Sent::kLost;
    const MutexLock lock(mutex_);
    wanted_ |= kRoom;
    if (!told_) arm_locked();
    return Sent::kLater;
  }
}

void PacketConnection::want_packet(When when) noexcept {
  const MutexLock lock(mutex_);
  wanted_ |= kPacket;
  when_ = when;
  if (!told_) arm_locked();
}

void PacketConnection::shut() noexcept {
  ::shutdown(file_, SHUT_RDWR);
  want_packet();
}

void PacketConnection::arm_locked() noexcept {
  const std::uint32_t events = ((wanted_ & kPacket) != 0 ? EPOLLIN | EPOLLRDHUP : 0) |
                               ((wanted_ & kRoom) != 0 ? std::uint32_t{EPOLLOUT} : 0) | EPOLLONESHOT;
  static_cast<void>(arm_in_epoll(*poll_, EPOLL_CTL_MOD, file_, events, static_cast<std::uint64_t>(file_)));
}

std::optional<ssize_t> PacketConnection::receive_now(std::span<char> room) noexcept {
  for (;;) {
    const ssize_t bytes = ::recv(file_, room.data(), room.size(), MSG_DONTWAIT);
    if (bytes >= 0) return bytes;
    if (errno == EAGAIN || errno == EWOULDBLOCK) return std::nullopt;
    // The other end closed with something unread; what it sent before comes next.
    if (errno != EINTR && errno != ECONNRESET) return bytes;
  }
}

}  // namespace warmfront::server
