// SPDX-License-Identifier: Apache-2.0
// A disk that blocks until released. Thread-safe.
#pragma once

#include <unistd.h>

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>

namespace warmfront::test {

class HangingDisk {
 public:
  /// For RecordingOptions::put: hangs in each write.
  static std::function<ssize_t(int, const char*, std::size_t)> put(std::shared_ptr<HangingDisk> disk) {
    return [disk = std::move(disk)](int file, const char* bytes, std::size_t count) {
      disk->hang();
      return ::write(file, bytes, count);
    };
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    hangs_ = false;
    changed_.notify_all();
  }

 private:
  void hang() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !hangs_; });
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool hangs_ = true;
};

}  // namespace warmfront::test
