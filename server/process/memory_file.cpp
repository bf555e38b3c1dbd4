// SPDX-License-Identifier: Apache-2.0
// By memfd_create(2) and dup3(2), which puts one file into another's place at once. Thread safety as stated
// in the header.
#include "server/process/memory_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace warmfront::server {
namespace {

/// Closed when it is destroyed, unless released.
class Descriptor {
 public:
  explicit Descriptor(int file) : file_(file) {}
  ~Descriptor() {
    if (file_ >= 0) ::close(file_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return file_; }
  int release() { return std::exchange(file_, -1); }

 private:
  int file_;
};

Error failed() {
  return {ErrorCode::kUnavailable, std::string("a file in memory: ") + std::strerror(errno)};
}

/// -1, with errno set, on an error.
int filled(const std::string& text, time_t modified) {
  Descriptor file(::memfd_create("warmfront", MFD_CLOEXEC));
  if (file.get() < 0) return -1;
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t wrote = ::write(file.get(), text.data() + done, text.size() - done);
    if (wrote < 0 && errno != EINTR) return -1;
    if (wrote > 0) done += static_cast<std::size_t>(wrote);
  }
  const std::array<timespec, 2> times{timespec{modified, 0}, timespec{modified, 0}};
  if (::futimens(file.get(), times.data()) != 0) return -1;
  return file.release();
}

}  // namespace

Result<std::unique_ptr<MemoryFile>> MemoryFile::create(const std::string& text) {
  const int file = filled(text, 1);
  if (file < 0) return failed();
  return std::unique_ptr<MemoryFile>(new MemoryFile(file));
}

MemoryFile::~MemoryFile() {
  ::close(file_);
}

Status MemoryFile::replace(const std::string& text) {
  struct stat before {};
  if (::fstat(file_, &before) != 0) return failed();
  const Descriptor file(filled(text, before.st_mtim.tv_sec + 1));
  if (file.get() < 0 || ::dup3(file.get(), file_, O_CLOEXEC) < 0) return failed();
  return {};
}

}  // namespace warmfront::server
