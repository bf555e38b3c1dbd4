// SPDX-License-Identifier: Apache-2.0
// Lists of which every element is written before it is read, by tasks that share that out. Who makes room in
// them does not touch new memory, which the system maps, and clears, page by page as it is touched: so that
// is shared out, too. Thread-safe for different lists.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/parallel/large_pages.h"

namespace warmfront {

/// Leaves elements that a list grows by as they are found.
template <class T>
struct Unwritten : std::allocator<T> {
  static_assert(std::is_trivially_default_constructible_v<T>);

  Unwritten() = default;
  template <class Other>
  Unwritten(const Unwritten<Other>& /*other*/) noexcept {}  // NOLINT: allocators convert
  template <class Other>
  struct rebind {
    using other = Unwritten<Other>;
  };

  void construct(T* at) noexcept { ::new (static_cast<void*>(at)) T; }  // not T(), which would clear it
  template <class... From>
  void construct(T* at, From&&... from) {
    ::new (static_cast<void*>(at)) T(std::forward<From>(from)...);
  }
};

template <class T>
using UnwrittenList = std::vector<T, Unwritten<T>>;

/// Makes a list so long; all of its elements are unspecified then. O(1) but for the system's share.
template <class T>
void make_room(UnwrittenList<T>& list, std::size_t size) {
  if (size > list.capacity()) {
    UnwrittenList<T> roomier;
    roomier.reserve(size);
    prefer_large_pages(roomier.data(), size * sizeof(T));
    list = std::move(roomier);
  }
  list.resize(size);
}

}  // namespace warmfront
