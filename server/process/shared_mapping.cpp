// SPDX-License-Identifier: Apache-2.0
// memfd_create(2), fcntl(2) F_ADD_SEALS. Thread safety as stated in the header.
#include "server/process/shared_mapping.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace warmfront::server {
namespace {

Error not_made(const char* what, int error) {
  return {ErrorCode::kResourceExhausted, std::string("shared memory: ") + what + ": " + std::strerror(error)};
}

}  // namespace

Result<std::shared_ptr<SharedMapping>> SharedMapping::create(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::getpagesize());
  const std::size_t size = (bytes + page - 1) / page * page;
  const int file = ::memfd_create("warmfront", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (file < 0) return not_made("no file", errno);
  void* data = MAP_FAILED;
  const char* what = "no pages";
  int error = ::ftruncate(file, static_cast<off_t>(size)) == 0 ? 0 : errno;
  if (error == 0) error = ::posix_fallocate(file, 0, static_cast<off_t>(size));
  if (error == 0) {
    what = "not mapped";
    if (::fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) error = errno;
  }
  if (error == 0) {
    data = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (data == MAP_FAILED) error = errno;
  }
  if (error != 0) {
    ::close(file);
    return not_made(what, error);
  }
  std::unique_ptr<SharedMapping> mapping;
  try {
    mapping.reset(new SharedMapping(static_cast<char*>(data), size, file));
  } catch (...) {
    ::munmap(data, size);
    ::close(file);
    throw;
  }
  return std::shared_ptr<SharedMapping>(std::move(mapping));
}

SharedMapping::~SharedMapping() {
  ::munmap(data_, size_);
  release_file();
}

void SharedMapping::release_file() {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

}  // namespace warmfront::server
