// SPDX-License-Identifier: Apache-2.0
// Memory that a daemon sees as well, in blocks. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>

namespace warmfront::client {

class SharedRegion : public std::enable_shared_from_this<SharedRegion> {
 public:
  /// Bytes of the region, given back with the last copy. The region lives for as long as its blocks do.
  struct Block {
    std::shared_ptr<char> data;
    std::uint64_t offset = 0;
    std::size_t size = 0;
  };

  /// Maps a memfd of at least `bytes`, which can become no smaller; null where it is none. The descriptor
  /// stays the caller's.
  static std::shared_ptr<SharedRegion> map(int file, std::uint64_t bytes);
  ~SharedRegion();
  SharedRegion(const SharedRegion&) = delete;
  SharedRegion& operator=(const SharedRegion&) = delete;

  std::size_t size() const { return size_; }
  /// What a block takes of it.
  static std::size_t room_of(std::size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }
  /// None where there is no room.
  std::optional<Block> take(std::size_t bytes);
  /// Of bytes within the region; empty where they are not.
  std::optional<std::string_view> at(std::uint64_t offset, std::uint64_t length) const;

 private:
  static constexpr std::size_t kAlignment = 64;

  SharedRegion(char* data, std::size_t size) : data_(data), size_(size) {}
  void give_back(std::uint64_t offset);

  // Constant after construction.
  char* const data_;
  const std::size_t size_;

  std::mutex mutex_;
  std::map<std::uint64_t, std::size_t> taken_;  // protected by mutex_: offset and length
};

}  // namespace warmfront::client
