// SPDX-License-Identifier: Apache-2.0
// epoll(7). Thread safety as stated in the header.
#include "server/process/packet_sockets.h"

#include <fcntl.h>
#include <sched.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace warmfront::server {
namespace {

constexpr std::uint64_t kWakeUp = ~std::uint64_t{0};
constexpr std::uint64_t kListener = std::uint64_t{1} << 62;

/// A listening socket in place of what is there; -1 with errno.
int listen_at(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return -1;
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  struct stat found {};
  if (::lstat(path.c_str(), &found) == 0 && S_ISSOCK(found.st_mode)) ::unlink(path.c_str());
  const int file = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (file < 0) return -1;
  if (::bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(file, SOMAXCONN) == 0)
    return file;
  const int error = errno;
  ::close(file);
  errno = error;
  return -1;
}

}  // namespace

Result<std::unique_ptr<PacketSockets>> PacketSockets::listen(const std::vector<std::string>& paths,
                                                             int threads, PacketWait::Time spin,
                                                             PacketReader& greeter) {
  const auto failed = [](const std::string& what) {
    return Error{ErrorCode::kUnavailable, "shared memory: " + what + ": " + std::strerror(errno)};
  };
  std::unique_ptr<PacketSockets> made(new PacketSockets(greeter));
  made->threads_count_ = threads;
  made->spin_ = spin;
  const int poll = ::epoll_create1(EPOLL_CLOEXEC);
  if (poll < 0) return failed("no epoll");
  made->poll_ = std::shared_ptr<const int>(new int(poll), [](const int* file) {
    ::close(*file);
    delete file;
  });
  made->wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (made->wake_ < 0 || !arm_in_epoll(poll, EPOLL_CTL_ADD, made->wake_, EPOLLIN, kWakeUp))
    return failed("no eventfd");
  for (const std::string& path : paths) {
    const int listener = listen_at(path);
    if (listener < 0) return failed(path);
    made->paths_.push_back(path);
    made->listeners_.push_back(listener);
    if (!arm_in_epoll(poll, EPOLL_CTL_ADD, listener, EPOLLIN | EPOLLONESHOT,
                      kListener | static_cast<std::uint64_t>(made->listeners_.size() - 1)))
      return failed(path);
  }
  return made;
}

void PacketSockets::begin() {
  threads_.emplace(threads_count_, [this](ReserveThreads::Hand& hand, std::chrono::milliseconds most) {
    return turn(hand, most);
  });
  threads_->begin();
}

void PacketSockets::end() noexcept {
  const std::uint64_t one = 1;
  if (wake_ >= 0) static_cast<void>(::write(wake_, &one, sizeof one));
  if (threads_) threads_->join();
}

PacketSockets::~PacketSockets() {
  end();
  for (const std::string& path : paths_) ::unlink(path.c_str());
  for (const int listener : listeners_) ::close(listener);
  if (wake_ >= 0) ::close(wake_);
  const MutexLock lock(mutex_);
  for (const auto& [file, connection] : connections_) ::shutdown(connection->file_, SHUT_RDWR);
}

bool PacketSockets::turn(ReserveThreads::Hand& hand, std::chrono::milliseconds most) noexcept {
  epoll_event event{};
  const int events = ::epoll_wait(*poll_, &event, 1, static_cast<int>(most.count()));
  drop_late();
  if (events <= 0) return true;
  if (event.data.u64 == kWakeUp) return false;  // it stays readable, for the others
  if ((event.data.u64 & kListener) != 0) {
    accept_from(static_cast<int>(event.data.u64 & ~kListener));
    return true;
  }
  const std::shared_ptr<PacketConnection> connection = connection_of(event.data.u64);
  if (!connection) return true;
  hand.begins();
  tell(connection);
  hand.ends();
  return true;
}

// Not accept4(): that is for gRPC's connections (accept.h).
void PacketSockets::accept_from(int index) noexcept {
  const int listener = listeners_[static_cast<std::size_t>(index)];
  const int file = ::accept(listener, nullptr, nullptr);
  const int error = errno;
  if (file >= 0) {
    try {
      static_cast<void>(::fcntl(file, F_SETFD, FD_CLOEXEC));
      std::shared_ptr<PacketConnection> connection;
      try {
        connection = std::make_shared<PacketConnection>(file, poll_);
      } catch (...) {
        ::close(file);
        throw;
      }
      const MutexLock lock(mutex_);
      if (unknown_ < kMostUnknown) {
        connections_.emplace(static_cast<std::uint64_t>(file), connection);
        ++unknown_;
        static_cast<void>(arm_in_epoll(*poll_, EPOLL_CTL_ADD, file, EPOLLIN | EPOLLRDHUP | EPOLLONESHOT,
                                       static_cast<std::uint64_t>(file)));
      }
    } catch (const std::exception&) {  // without memory the connection is refused
    }
  }
  if (file < 0 && (error == EMFILE || error == ENFILE)) {
    without_files_ = true;  // armed again by drop_late(): it would be told of again at once
    return;
  }
  static_cast<void>(arm_in_epoll(*poll_, EPOLL_CTL_MOD, listener, EPOLLIN | EPOLLONESHOT,
                                 kListener | static_cast<std::uint64_t>(index)));
}

void PacketSockets::tell(const std::shared_ptr<PacketConnection>& connection) noexcept {
  {
    const MutexLock lock(connection->mutex_);
    if (std::exchange(connection->told_, true)) return;
    // The first packet is wanted without a word.
    if (!connection->known_) connection->wanted_ |= PacketConnection::kPacket;
  }
  // One more byte than a packet may have tells which is too long.
  std::array<char, PacketConnection::kMostBytes + 1> room;
  for (bool waits = false, has_come = true;;) {
    std::uint32_t wanted = 0;
    PacketConnection::When when{};
    {
      const MutexLock lock(connection->mutex_);
      wanted = connection->wanted_;
      when = connection->when_;
      if (waits || wanted == 0) {
        connection->told_ = false;
        if (wanted != 0) connection->arm_locked();
        return;
      }
      if ((wanted & PacketConnection::kRoom) != 0)
        connection->wanted_ &= ~std::uint32_t{PacketConnection::kRoom};
    }
    if ((wanted & PacketConnection::kRoom) != 0) {
      // If there is none, sending says so again.
      if (const std::shared_ptr<PacketReader> reader = reader_of(*connection)) reader->has_room(connection);
      const MutexLock lock(connection->mutex_);
      if ((connection->wanted_ & PacketConnection::kRoom) != 0) waits = true;
      continue;
    }
    std::optional<ssize_t> bytes;
    if (std::exchange(has_come, false)) bytes = connection->receive_now(room);
    if (!bytes) bytes = await(*connection, when, room);
    if (!bytes) {
      waits = true;
      continue;
    }
    bool goes_on = *bytes > 0 && *bytes <= static_cast<ssize_t>(PacketConnection::kMostBytes);
    if (goes_on) {
      {
        const MutexLock lock(connection->mutex_);
        connection->wanted_ &= ~std::uint32_t{PacketConnection::kPacket};
      }
      const std::shared_ptr<PacketReader> reader = reader_of(*connection);
      goes_on = reader && reader->packet(connection, {room.data(), static_cast<std::size_t>(*bytes)});
    }
    if (goes_on) continue;
    ::shutdown(connection->file_, SHUT_RDWR);
    forget(connection);
    if (const std::shared_ptr<PacketReader> reader = reader_of(*connection)) reader->lost(connection);
    return;
  }
}

std::optional<ssize_t> PacketSockets::await(PacketConnection& connection, PacketConnection::When when,
                                            std::span<char> room) noexcept {
  static const bool one_core = std::thread::hardware_concurrency() < 2;
  // To arm it tells of what has come.
  if (one_core || !connection.known_) return std::nullopt;
  const PacketWait::Time most = connection.wait_.next(when, spin_);
  if (most <= PacketWait::Time(0)) return std::nullopt;
  std::optional<ssize_t> bytes = connection.receive_now(room);
  if (!bytes) {
    // Another thread stays for the other connections.
    if (spinning_.fetch_add(1, std::memory_order_relaxed) < threads_count_ - 1) {
      const auto until = std::chrono::steady_clock::now() + most;
      do {
        ::sched_yield();  // whoever else wants this core has it
        bytes = connection.receive_now(room);
      } while (!bytes && std::chrono::steady_clock::now() < until);
    }
    spinning_.fetch_sub(1, std::memory_order_relaxed);
  }
  connection.wait_.ended(when, bytes.has_value());
  return bytes;
}

std::shared_ptr<PacketReader> PacketSockets::reader_of(const PacketConnection& connection) {
  if (connection.known_) return connection.reader_.lock();
  return {std::shared_ptr<void>(), &greeter_};  // which outlives this
}

void PacketSockets::keep(PacketConnection& connection, std::weak_ptr<PacketReader> reader) {
  const MutexLock lock(mutex_);
  connection.reader_ = std::move(reader);
  if (connection.known_.exchange(true)) return;
  if (connections_.contains(static_cast<std::uint64_t>(connection.file_))) --unknown_;
}

void PacketSockets::forget(const std::shared_ptr<PacketConnection>& connection) noexcept {
  const MutexLock lock(mutex_);
  if (connections_.erase(static_cast<std::uint64_t>(connection->file_)) > 0 && !connection->known_)
    --unknown_;
}

void PacketSockets::drop_late() noexcept {
  const auto now = std::chrono::steady_clock::now();
  {
    const MutexLock lock(mutex_);
    if (now - looked_ < std::chrono::seconds(1)) return;
    looked_ = now;
    if (unknown_ > 0)
      for (const auto& [file, connection] : connections_)
        if (!connection->known_ && now - connection->since_ >= kGreeting)
          ::shutdown(connection->file_, SHUT_RDWR);  // of which its thread hears
  }
  if (!without_files_.exchange(false)) return;
  for (std::size_t i = 0; i < listeners_.size(); ++i)
    static_cast<void>(
        arm_in_epoll(*poll_, EPOLL_CTL_MOD, listeners_[i], EPOLLIN | EPOLLONESHOT, kListener | i));
}

}  // namespace warmfront::server
