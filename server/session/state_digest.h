// SPDX-License-Identifier: Apache-2.0
// The digest of what a session was made of: a chain of hashes over all input that it accepted, in its order.
// Used by one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace warmfront::server {

/// What a copy of a session is; see SessionState on the wire.
struct SessionState {
  std::uint64_t frame = 0;
  std::uint64_t revision = 0;
  std::uint64_t digest = 0;
  friend bool operator==(const SessionState&, const SessionState&) = default;
};

/// Where a session stands, and before the last frame or change that it accepted, if there was one.
struct Standing {
  SessionState now;
  std::optional<SessionState> before;
};

/// What is taken in after a state's own digest tells frames, which begin with 0 or 1, from changes and
/// commits.
inline constexpr std::uint64_t kDigestOfChange = 2;
inline constexpr std::uint64_t kDigestOfCommit = 3;

/// A hash of bytes that come in pieces: the same for the same bytes, however they were cut. It is taken as
/// they are copied, which hides it behind the reading; what they are added to may be known later.
class ContentHash {
 public:
  ContentHash();

  void add(std::string_view piece);
  /// Copies a piece, and takes in the copy: who still writes to the piece cannot tell the two apart. Each
  /// byte is read once. `to` has room for it, apart from it.
  void copy(std::string_view piece, char* to);

 private:
  friend class StateDigest;
  static constexpr std::size_t kLanes = 8;
  static constexpr std::size_t kBlock = kLanes * sizeof(std::uint64_t);
  using Lanes = std::array<std::uint64_t, kLanes>;

  Lanes ended() const;

  Lanes lanes_;
  std::array<char, kBlock> begun_{};  // the block that the pieces so far end in, where that is not full
  std::uint64_t bytes_ = 0;
};

/// 64 bits of a state or of content. Hashing takes far less than a byte a cycle: many times less than the
/// reading of positions that a step begins with.
class StateDigest {
 public:
  explicit StateDigest(std::uint64_t seed) : value_(seed) {}

  /// Takes a field's bytes into the digest. Their number counts too, so that bytes that move from a field to
  /// the next make another digest.
  void add(std::string_view bytes) {
    ContentHash content;
    content.add(bytes);
    add(content);
  }
  void add(std::uint64_t number);
  void add(const ContentHash& content);
  template <class T, std::size_t kExtent>
  void add(std::span<const T, kExtent> values) {
    add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size_bytes()));
  }

  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_;
};

}  // namespace warmfront::server
