// SPDX-License-Identifier: Apache-2.0
// A file that is nowhere but in this process' memory, for libraries that read files only. Thread-safe.
#pragma once

#include <memory>
#include <string>

#include "engine/result.h"

namespace warmfront::server {

class MemoryFile {
 public:
  /// UNAVAILABLE where the system gives no file.
  static Result<std::unique_ptr<MemoryFile>> create(const std::string& text);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Whoever opens path() from now on reads this, whole; who has opened it reads on in what was there. Each
  /// text is modified a second after the one before at least, so that who reads twice can tell. On an error
  /// what was there stays.
  Status replace(const std::string& text);

  /// Of this process alone.
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  explicit MemoryFile(int file) : file_(file) {}
  const int file_;
};

}  // namespace warmfront::server
