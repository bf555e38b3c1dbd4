// SPDX-License-Identifier: Apache-2.0
// The contacts that one thread has found: in blocks, so that the list grows without moving what is in it, and
// what new memory costs is spread over the contacts that it is for.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "engine/contact.h"

namespace warmfront {

/// Used by one thread at a time. Emptied, it keeps its memory.
class ContactList {
 public:
  static constexpr std::size_t kLeastOfBlock = 32;
  static constexpr std::size_t kMostOfBlock = 2048;

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  /// There must be one.
  const Contact& back() const { return blocks_[used_ - 1].back(); }

  void push_back(const Contact& contact) {
    if (used_ == 0 || blocks_[used_ - 1].size() == blocks_[used_ - 1].capacity()) begin_block();
    blocks_[used_ - 1].push_back(contact);
    ++size_;
  }

  void clear() noexcept { truncate(0, 0, 0); }

  /// Removes those for which `which` is true; the others stay in order.
  template <class Which>
  void erase_if(Which&& which) {
    std::size_t block = 0, at = 0, kept = 0;  // the next that stays goes there
    for (std::size_t from = 0; from < used_; ++from) {
      for (const Contact& contact : blocks_[from]) {
        if (which(contact)) continue;
        if (at == blocks_[block].capacity()) {
          ++block;
          at = 0;
        }
        blocks_[block][at++] = contact;
        ++kept;
      }
    }
    truncate(kept, kept == 0 ? 0 : block + 1, at);
  }

  /// Calls `take` with the contacts as spans of at most kMostOfBlock, in order.
  template <class Take>
  void for_blocks(Take&& take) const {
    for (std::size_t block = 0; block < used_; ++block) take(std::span<const Contact>(blocks_[block]));
  }

  std::size_t memory_bytes() const {
    std::size_t bytes = blocks_.capacity() * sizeof(blocks_[0]);
    for (const std::vector<Contact>& block : blocks_) bytes += block.capacity() * sizeof(Contact);
    return bytes;
  }

 private:
  void begin_block() {
    if (used_ == blocks_.size()) {
      std::vector<Contact> block;
      block.reserve(std::clamp(size_, kLeastOfBlock, kMostOfBlock));
      blocks_.push_back(std::move(block));
    }
    ++used_;
  }

  // To so many contacts in so many blocks, of which the last has `of_last`, and all before it are full.
  void truncate(std::size_t contacts, std::size_t blocks, std::size_t of_last) noexcept {
    for (; used_ > blocks; --used_) blocks_[used_ - 1].clear();
    if (blocks != 0) blocks_[blocks - 1].resize(of_last);
    size_ = contacts;
  }

  std::vector<std::vector<Contact>> blocks_;  // of those in use, all but the last are full
  std::size_t used_ = 0;
  std::size_t size_ = 0;
};

}  // namespace warmfront
