// SPDX-License-Identifier: Apache-2.0
// The positions of a frame, in this process's memory or in what a daemon sees as well. Immutable, and cheap
// to copy.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "client/lib/shared_region.h"

namespace warmfront::client {

class FrameBytes {
 public:
  FrameBytes() = default;
  explicit FrameBytes(std::shared_ptr<const std::string> string)
      : data_(string, string->data()), size_(string->size()) {}
  /// A copy, in the region where there is one with room.
  static FrameBytes copy_of(std::string_view bytes, SharedRegion* region) {
    std::optional<SharedRegion::Block> block = region == nullptr ? std::nullopt : region->take(bytes.size());
    if (!block) return FrameBytes(std::make_shared<const std::string>(bytes));
    if (!bytes.empty()) std::memcpy(block->data.get(), bytes.data(), bytes.size());
    FrameBytes copy;
    copy.data_ = std::move(block->data);
    copy.size_ = bytes.size();
    copy.region_ = region;
    copy.offset_ = block->offset;
    return copy;
  }

  explicit operator bool() const { return data_ != nullptr; }
  std::string_view view() const { return {data_.get(), size_}; }
  const char* data() const { return data_.get(); }
  std::size_t size() const { return size_; }
  const std::shared_ptr<const char>& owner() const { return data_; }
  /// Where it is in this region, if it is.
  std::optional<std::uint64_t> offset_in(const SharedRegion* region) const {
    return region != nullptr && region == region_ ? std::optional(offset_) : std::nullopt;
  }

 private:
  std::shared_ptr<const char> data_;
  std::size_t size_ = 0;
  const SharedRegion* region_ = nullptr;  // which data_ keeps; to be compared only
  std::uint64_t offset_ = 0;
};

}  // namespace warmfront::client
