// SPDX-License-Identifier: Apache-2.0
#include "client/lib/shared_region.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

namespace warmfront::client {

std::shared_ptr<SharedRegion> SharedRegion::map(int file, std::uint64_t bytes) {
  struct stat found {};
  const int seals = ::fcntl(file, F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0 || ::fstat(file, &found) != 0 || found.st_size <= 0 ||
      static_cast<std::uint64_t>(found.st_size) < bytes)
    return nullptr;
  const auto size = static_cast<std::size_t>(bytes);
  void* data = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (data == MAP_FAILED) return nullptr;
  return std::shared_ptr<SharedRegion>(new SharedRegion(static_cast<char*>(data), size));
}

SharedRegion::~SharedRegion() {
  ::munmap(data_, size_);
}

// The first gap that is long enough: there are a few blocks only.
std::optional<SharedRegion::Block> SharedRegion::take(std::size_t bytes) {
  const std::size_t length = room_of(bytes == 0 ? 1 : bytes);
  std::uint64_t at = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [offset, taken] : taken_) {
      if (offset - at >= length) break;
      at = offset + taken;
    }
    if (at > size_ || size_ - at < length) return std::nullopt;
    taken_.emplace(at, length);
  }
  return Block{
      std::shared_ptr<char>(data_ + at, [self = shared_from_this(), at](char*) { self->give_back(at); }), at,
      bytes};
}

void SharedRegion::give_back(std::uint64_t offset) {
  const std::lock_guard lock(mutex_);
  taken_.erase(offset);
}

std::optional<std::string_view> SharedRegion::at(std::uint64_t offset, std::uint64_t length) const {
  if (offset > size_ || length > size_ - offset) return std::nullopt;
  return std::string_view(data_ + offset, static_cast<std::size_t>(length));
}

}  // namespace warmfront::client
