// SPDX-License-Identifier: Apache-2.0
// unix(7), SOCK_SEQPACKET. Thread safety as stated in the header.
#include "client/lib/packet_channel.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <thread>
#include <utility>

#include "proto/wire/shared_columns.h"

namespace warmfront::client {
namespace {

using WallClock = std::chrono::system_clock;

constexpr std::chrono::seconds kBinding{2};

/// Until there is something, or until then; a negative number of an error.
int wait_for(int socket, short events, PacketChannel::Deadline until) {
  using std::chrono::nanoseconds;
  constexpr nanoseconds kMost = std::chrono::hours(1);
  const auto left = std::clamp<nanoseconds>(until - WallClock::now(), nanoseconds(0), kMost);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  const timespec time{static_cast<time_t>(seconds.count()), static_cast<long>((left - seconds).count())};
  pollfd one{socket, events, 0};
  const int ready = ::ppoll(&one, 1, &time, nullptr);
  return ready < 0 && errno == EINTR ? 0 : ready;
}

/// Threads of this process that wait without sleeping: one core is left to whoever computes.
std::atomic<unsigned> spinning{0};

}  // namespace

std::unique_ptr<PacketChannel> PacketChannel::open(const std::string& path, const std::string& session_id,
                                                   const std::string& token, std::uint64_t bytes) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return nullptr;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return nullptr;
  std::unique_ptr<PacketChannel> channel(new PacketChannel(socket));
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return nullptr;
  channel->packet_.resize(wire::kMostPacketBytes);
  v1::SharedMemoryRequest request;
  request.set_session_id(session_id);
  request.set_token(token);
  request.set_bytes(bytes);
  return channel->take_memory(request) ? std::move(channel) : nullptr;
}

PacketChannel::~PacketChannel() {
  ::close(socket_);
}

void PacketChannel::ask_for(std::uint64_t bytes) {
  if (refused_) return;
  v1::SharedMemoryRequest request;
  request.set_bytes(bytes);
  refused_ = !take_memory(request);
}

bool PacketChannel::take_memory(const v1::SharedMemoryRequest& request) {
  const Deadline deadline = WallClock::now() + kBinding;
  v1::StreamStepsRequest message;
  *message.mutable_shared_memory() = request;
  const std::string bytes = message.SerializeAsString();
  if (send({bytes}, deadline) != Event::kDone) return false;
  int file = -1;
  ssize_t length = 0;
  while ((length = receive_now(&file)) < 0)
    if (wait_for(socket_, POLLIN, deadline) < 0 || WallClock::now() >= deadline) return false;
  v1::StreamStepsResponse response;
  if (length > 0 && file >= 0 && response.ParseFromArray(packet_.data(), static_cast<int>(length)) &&
      response.has_shared_memory()) {
    if (std::shared_ptr<SharedRegion> region = SharedRegion::map(file, response.shared_memory().bytes()))
      region_ = std::move(region);
    else
      length = 0;
  } else {
    length = 0;
  }
  if (file >= 0) ::close(file);
  return length > 0;
}

PacketChannel::Event PacketChannel::send(const std::vector<std::string_view>& pieces, Deadline deadline) {
  std::vector<iovec> parts;
  for (const std::string_view piece : pieces)
    parts.push_back({const_cast<char*>(piece.data()), piece.size()});
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = parts.size();
  for (;;) {
    if (::sendmsg(socket_, &message, MSG_NOSIGNAL) >= 0) return Event::kDone;
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != ENOBUFS) return Event::kEnded;
    if (WallClock::now() >= deadline) return Event::kTimeout;
    if (wait_for(socket_, POLLOUT, deadline) < 0) return Event::kEnded;
  }
}

ssize_t PacketChannel::receive_now(int* file) {
  iovec part{packet_.data(), packet_.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  for (;;) {
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (file != nullptr) {
      message.msg_control = control.data();
      message.msg_controllen = control.size();
    }
    const ssize_t length = ::recvmsg(socket_, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (length < 0 && errno == EAGAIN) return kNothing;
    // Closed by the daemon with something unread; what it sent before comes next.
    if (length < 0 && (errno == EINTR || errno == ECONNRESET)) continue;
    const cmsghdr* header = file == nullptr || length < 0 ? nullptr : CMSG_FIRSTHDR(&message);
    if (header != nullptr && header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS)
      std::memcpy(file, CMSG_DATA(header), sizeof *file);
    return std::max<ssize_t>(length, 0);
  }
}

ssize_t PacketChannel::spin(std::chrono::steady_clock::time_point until) {
  static const unsigned cores = std::thread::hardware_concurrency();
  ssize_t length = receive_now();
  if (spinning.fetch_add(1, std::memory_order_relaxed) + 1 < cores) {
    while (length < 0 && std::chrono::steady_clock::now() < until) {
      ::sched_yield();  // whoever else wants this core has it
      length = receive_now();
    }
  }
  spinning.fetch_sub(1, std::memory_order_relaxed);
  return length;
}

ssize_t PacketChannel::await(Deadline deadline, const Look& look) {
  using std::chrono::steady_clock;
  const auto began = steady_clock::now();
  const auto at = [&](SpinForecast::Time time) {
    return began + std::chrono::duration_cast<steady_clock::duration>(time);
  };
  std::optional<SpinForecast::Window> window = forecast_.next();
  bool spun = !window;
  Deadline until = look ? std::min(deadline, look()) : deadline;  // it may end the waiting
  for (;;) {
    const auto now = steady_clock::now();
    const bool spins = !spun && now >= at(window->begin);
    spun = spun || spins;
    const ssize_t length = spins ? spin(at(window->end)) : receive_now();
    if (length >= 0) {
      forecast_.came(steady_clock::now() - began, window);
      return length;
    }
    const Deadline wall = WallClock::now();
    if (wall >= deadline) return kNothing;
    if (look && wall >= until) until = std::min(deadline, look());
    const Deadline next =
        spun ? until
             : std::min(until, wall + std::chrono::ceil<WallClock::duration>(at(window->begin) - now));
    if (wait_for(socket_, POLLIN, next) < 0) return 0;
  }
}

PacketChannel::Event PacketChannel::receive(v1::StreamStepsResponse& response, Deadline deadline,
                                            const Look& look) {
  ssize_t length = receive_now();
  if (length == kNothing) length = await(deadline, look);
  if (length == kNothing) return Event::kTimeout;
  if (length == 0 || !response.ParseFromArray(packet_.data(), static_cast<int>(length))) return Event::kEnded;
  return Event::kDone;
}

}  // namespace warmfront::client
