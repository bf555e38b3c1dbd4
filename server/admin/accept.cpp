// SPDX-License-Identifier: Apache-2.0
// An accept4() that never fails for want of files. Thread safety as stated in the header.
#include "server/admin/accept.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

#include "server/annotations.h"

namespace warmfront::server {
namespace {

struct Reserve {
  Mutex mutex;
  int file WARMFRONT_GUARDED_BY(mutex) = -1;
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

/// Closes every connection that waits, by means of the file set aside.
void refuse_waiting(int listener) {
  Reserve& reserve = shared_reserve();
  const MutexLock lock(reserve.mutex);
  if (reserve.file < 0) return;
  for (;;) {
    close(reserve.file);
    const int connection = accept_now(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection >= 0) close(connection);
    const bool more = connection >= 0 || errno == ECONNABORTED || errno == EINTR;
    reserve.file = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (!more || reserve.file < 0) return;
  }
}

}  // namespace

void refuse_connections_without_files() {
  Reserve& reserve = shared_reserve();
  const MutexLock lock(reserve.mutex);
  if (reserve.file < 0) reserve.file = open("/dev/null", O_RDONLY | O_CLOEXEC);
}

}  // namespace warmfront::server

extern "C" int accept4(int listener, sockaddr* address, socklen_t* length, int flags) {
  using namespace warmfront::server;
  const int connection = accept_now(listener, address, length, flags);
  if (connection >= 0 || !out_of_files()) return connection;
  refuse_waiting(listener);
  // Nothing waits any more, which is the error that gRPC takes for what it is.
  errno = EAGAIN;
  return -1;
}
