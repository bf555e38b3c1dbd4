// SPDX-License-Identifier: Apache-2.0
// Memory that another process sees as well: a memfd, made, sized, sealed and mapped here. Immutable but for
// what is in it, which the other process may change at any time, between any two instructions: what is read
// here is copied first and looked at then, and what is written here is never read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "engine/result.h"

namespace warmfront::server {

class SharedMapping {
 public:
  /// All pages are taken now, so that writing to them never fails for want of memory; and the size is sealed,
  /// so that nobody makes them vanish. `bytes` >= 1, rounded up to whole pages. kResourceExhausted without
  /// memory or files.
  static Result<std::shared_ptr<SharedMapping>> create(std::size_t bytes);
  ~SharedMapping();
  SharedMapping(const SharedMapping&) = delete;
  SharedMapping& operator=(const SharedMapping&) = delete;

  std::size_t size() const { return size_; }
  /// The memfd, to be handed on; -1 after release_file().
  int file() const { return file_; }
  /// The mapping needs it no more.
  void release_file();
  /// Is [offset, offset + length) within?
  bool holds(std::uint64_t offset, std::uint64_t length) const {
    return offset <= size_ && length <= size_ - offset;
  }
  /// Of bytes that it holds. To be copied once, and not to be looked at.
  std::string_view read(std::uint64_t offset, std::uint64_t length) const { return {data_ + offset, length}; }
  char* write(std::uint64_t offset) { return data_ + offset; }

 private:
  SharedMapping(char* data, std::size_t size, int file) : data_(data), size_(size), file_(file) {}

  char* const data_;
  const std::size_t size_;
  int file_;
};

}  // namespace warmfront::server
