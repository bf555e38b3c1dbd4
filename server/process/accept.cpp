// SPDX-License-Identifier: Apache-2.0
// An accept4() that never fails for want of files. Thread safety as stated in the header.
#include "server/process/accept.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <utility>

#include "server/annotations.h"
#include "server/process/guarded_receive.h"

namespace warmfront::server {
namespace {

struct Reserve {
  Mutex mutex;
  int file WARMFRONT_GUARDED_BY(mutex) = -1;
  /// Listeners on which connections wait that could not be refused; -1: none. gRPC hears of a connection
  /// once.
  std::array<int, 16> left_waiting WARMFRONT_GUARDED_BY(mutex) = none();
  /// Whether one of the two above is not as it should be; to be asked without the lock.
  std::atomic<bool> lacking{false};
  std::atomic<std::uint64_t> refused{0};

  static std::array<int, 16> none() {
    std::array<int, 16> files{};
    files.fill(-1);
    return files;
  }
};

Reserve& shared_reserve() {
  static Reserve& shared = *new Reserve;  // used by threads of gRPC until the process is gone
  return shared;
}

int accept_now(int listener, sockaddr* address, socklen_t* length, int flags) {
  return static_cast<int>(syscall(SYS_accept4, listener, address, length, flags));
}

bool out_of_files() {
  return errno == EMFILE || errno == ENFILE;
}

/// Whether there is a file set aside. Between giving it up and taking it back another thread may have opened
/// a file instead: then it is taken back later, when one is free.
bool take_back(Reserve& reserve) WARMFRONT_REQUIRES(reserve.mutex) {
  if (reserve.file < 0) reserve.file = open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (reserve.file < 0) reserve.lacking = true;
  return reserve.file >= 0;
}

/// Closes every connection that waits, by means of the file set aside. False when there was none for it.
bool refuse_waiting(Reserve& reserve, int listener) WARMFRONT_REQUIRES(reserve.mutex) {
  while (take_back(reserve)) {
    close(std::exchange(reserve.file, -1));
    const int connection = accept_now(listener, nullptr, nullptr, SOCK_CLOEXEC);
    const int error = errno;
    if (connection >= 0) {
      close(connection);
      ++reserve.refused;
    }
    take_back(reserve);
    // Without a file again: someone else was faster.
    if (connection < 0 && (error == EMFILE || error == ENFILE)) return false;
    if (connection < 0 && error != ECONNABORTED && error != EINTR) return true;
  }
  return false;
}

void note_waiting(Reserve& reserve, int listener) WARMFRONT_REQUIRES(reserve.mutex) {
  reserve.lacking = true;
  if (std::ranges::count(reserve.left_waiting, listener) > 0) return;
  const auto place = std::ranges::find(reserve.left_waiting, -1);
  if (place != reserve.left_waiting.end()) *place = listener;
}

}  // namespace

void refuse_connections_without_files() {
  Reserve& reserve = shared_reserve();
  const MutexLock lock(reserve.mutex);
  take_back(reserve);
}

std::uint64_t connections_without_files() {
  return shared_reserve().refused;
}

void refuse_connections_left_waiting() {
  Reserve& reserve = shared_reserve();
  if (!reserve.lacking) return;
  const MutexLock lock(reserve.mutex);
  if (!take_back(reserve)) return;
  reserve.lacking = false;
  for (int& listener : reserve.left_waiting)
    if (listener >= 0 && refuse_waiting(reserve, listener))
      listener = -1;
    else if (listener >= 0)
      reserve.lacking = true;
}

}  // namespace warmfront::server

extern "C" int accept4(int listener, sockaddr* address, socklen_t* length, int flags) {
  using namespace warmfront::server;
  sockaddr_storage own{};
  socklen_t own_length = sizeof own;
  if (address == nullptr) {
    address = reinterpret_cast<sockaddr*>(&own);
    length = &own_length;
  }
  const socklen_t room = *length;
  int connection = accept_now(listener, address, length, flags);
  while (connection >= 0 && !guard_connection(connection, address, *length)) {
    close(connection);
    *length = room;
    connection = accept_now(listener, address, length, flags);
  }
  if (connection >= 0 || !out_of_files()) return connection;
  {
    Reserve& reserve = shared_reserve();
    const MutexLock lock(reserve.mutex);
    if (!refuse_waiting(reserve, listener)) note_waiting(reserve, listener);
  }
  // Nothing waits any more, or nothing can be done now: the error that gRPC takes for what it is.
  errno = EAGAIN;
  return -1;
}
