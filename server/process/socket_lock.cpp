// SPDX-License-Identifier: Apache-2.0
// flock(2) on a file beside the socket. Thread safety as stated in the header.
#include "server/process/socket_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace warmfront::server {
namespace {

/// Whether the path still names this file: who held the lock before may have removed it.
bool names(const std::string& path, int file) {
  struct stat there {};
  struct stat here {};
  return ::stat(path.c_str(), &there) == 0 && ::fstat(file, &here) == 0 && there.st_dev == here.st_dev &&
         there.st_ino == here.st_ino;
}

}  // namespace

Result<SocketLock> SocketLock::acquire(const std::string& socket_path) {
  const std::string path = socket_path + ".lock";
  for (;;) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file < 0)
      return Error{ErrorCode::kUnavailable,
                   "listen unix:" + socket_path + ": " + path +
                       ", which keeps others from the socket, cannot be made: " + std::strerror(errno)};
    SocketLock lock(path, file);
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      ::close(std::exchange(lock.file_, -1));  // it is another's: not to be removed
      if (error == EINTR) continue;
      if (error != EWOULDBLOCK)
        return Error{ErrorCode::kUnavailable, "listen unix:" + socket_path + ": " + path +
                                                  " cannot be locked: " + std::strerror(error)};
      return Error{
          ErrorCode::kFailedPrecondition,
          "listen unix:" + socket_path +
              ": another process listens there, or is about to; stop it first, or choose another path"};
    }
    if (names(path, file)) return lock;
    ::close(std::exchange(lock.file_, -1));
  }
}

SocketLock::~SocketLock() {
  if (file_ < 0) return;
  if (names(path_, file_)) ::unlink(path_.c_str());
  ::close(file_);
}

}  // namespace warmfront::server
