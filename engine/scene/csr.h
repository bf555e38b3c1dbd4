// SPDX-License-Identifier: Apache-2.0
// Lists of lists in two arrays (compressed rows). Immutable once built.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace warmfront {

struct Csr {
  std::vector<std::uint32_t> begin;  ///< rows + 1 offsets into `items`
  std::vector<std::uint32_t> items;

  std::span<const std::uint32_t> operator[](std::size_t row) const {
    return {items.data() + begin[row], items.data() + begin[row + 1]};
  }
  std::size_t rows() const { return begin.empty() ? 0 : begin.size() - 1; }
  std::size_t memory_bytes() const { return (begin.capacity() + items.capacity()) * sizeof(std::uint32_t); }
};

}  // namespace warmfront
