// SPDX-License-Identifier: Apache-2.0
// A Unix socket's path belongs to one daemon at a time. Thread-safe.
#pragma once

#include <string>
#include <utility>

#include "engine/result.h"

namespace warmfront::server {

/// gRPC removes whatever socket has the path and puts its own there: of two daemons started at once each
/// would find the path free, and the second would take it away from the first, silently. So a daemon that
/// listens there holds a lock on the file PATH.lock, which ends with the process however that ends; a clean
/// end removes the file, and one that was left behind is no obstacle.
class SocketLock {
 public:
  /// FAILED_PRECONDITION when another process, or this one, has the path; UNAVAILABLE when the file cannot be
  /// made. Does not wait.
  static Result<SocketLock> acquire(const std::string& socket_path);

  SocketLock(SocketLock&& other) noexcept
      : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}
  SocketLock& operator=(SocketLock&&) = delete;
  ~SocketLock();

 private:
  SocketLock(std::string path, int file) : path_(std::move(path)), file_(file) {}

  std::string path_;
  int file_;
};

}  // namespace warmfront::server
