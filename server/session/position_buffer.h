// SPDX-License-Identifier: Apache-2.0
// Positions as they arrive: bytes in any number of pieces, put together in the session's number format.
// Used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/collider.h"
#include "engine/result.h"
#include "server/session/state_digest.h"

namespace warmfront::server {

enum class Dtype : std::uint8_t { kFloat32, kFloat64 };

inline std::size_t size_of(Dtype dtype) {
  return dtype == Dtype::kFloat32 ? 4 : 8;
}

/// Leaves new numbers as they are: bytes that arrive are about to be written over them.
template <class T>
struct Unwritten : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = Unwritten<U>;
  };
  void construct(T* number) noexcept { ::new (static_cast<void*>(number)) T; }
  void construct(T* number, T value) noexcept { ::new (static_cast<void*>(number)) T(value); }
};

class PositionBuffer;

/// What positions were in.
class PositionMemory {
 public:
  std::size_t bytes() const {
    return std::visit([](const auto& values) { return values.capacity() * sizeof(values[0]); }, values_);
  }

 private:
  friend class PositionBuffer;
  friend bool operator==(const PositionBuffer& a, const PositionBuffer& b);
  template <class T>
  using Numbers = std::vector<T, Unwritten<T>>;
  std::variant<Numbers<float>, Numbers<double>> values_;
};

/// Row-major (n, 3), little-endian.
class PositionBuffer {
 public:
  PositionBuffer(Dtype dtype, std::uint32_t vertex_count);

  /// Of an empty buffer: what arrives goes there, where that has room for all of it and little more.
  void reuse(PositionMemory memory) noexcept;
  /// Ends this buffer.
  PositionMemory release() noexcept { return std::move(memory_); }

  /// Appends the next bytes; a piece may end within a number. INVALID_ARGUMENT beyond 3 n sizeof(dtype)
  /// bytes: nothing is appended then or later. Memory grows with what arrives, never with what was announced.
  Status append(std::string_view bytes) { return append(std::span(&bytes, 1)); }
  Status append(std::span<const std::string_view> pieces);
  /// INVALID_ARGUMENT unless all bytes are there, and no more than these were offered.
  Status complete() const;

  /// Bytes of the positions when complete.
  std::size_t expected_bytes() const { return expected_; }
  /// The positions, once complete; valid while the buffer is.
  Positions view() const;
  /// As they came; as valid as view().
  std::string_view bytes() const;
  /// Of bytes().
  const ContentHash& hash() const { return hash_; }
  /// The same bytes? What was refused is like nothing.
  friend bool operator==(const PositionBuffer& a, const PositionBuffer& b);

 private:
  std::string shape() const;

  std::size_t expected_;
  std::size_t received_ = 0;
  ContentHash hash_;
  std::optional<Error> overflow_;
  template <class T>
  using Numbers = PositionMemory::Numbers<T>;
  PositionMemory memory_;
};

}  // namespace warmfront::server
