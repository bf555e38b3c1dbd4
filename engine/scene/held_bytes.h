// SPDX-License-Identifier: Apache-2.0
// What vectors hold, for memory_bytes(): their room, whether or not it is filled. Thread-safe.
#pragma once

#include <cstddef>

namespace warmfront {

/// Bytes of memory that the vectors hold in all.
template <class... Vectors>
std::size_t held_bytes(const Vectors&... vectors) {
  return (std::size_t{0} + ... + (vectors.capacity() * sizeof(typename Vectors::value_type)));
}

}  // namespace warmfront
