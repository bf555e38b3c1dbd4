// SPDX-License-Identifier: Apache-2.0
// The connections of each address: what the guard bounds a connection (http2_guard.h), this bounds a client.
// Thread-safe.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include "server/annotations.h"
#include "server/process/bucket.h"

namespace warmfront::server {

class Peers {
 public:
  /// Of an address at most `most` connections are open at once, and over any time of t seconds at most
  /// 2 most + t most / 10 begin; 0: not bounded. `now` is asked seldom; tests bring their own.
  explicit Peers(std::uint32_t most, Bucket::Now now = &Bucket::Clock::now) : most_(most), now_(now) {}

  /// Holds a connection's place among those of its address, until it is gone. Outlived by its Peers.
  class Place {
   public:
    Place() = default;  ///< of a connection that nobody counts
    Place(Place&& other) noexcept : peers_(std::exchange(other.peers_, nullptr)), key_(other.key_) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(peers_, other.peers_);
      std::swap(key_, other.key_);
      return *this;
    }
    ~Place() {
      if (peers_ != nullptr) peers_->leave(key_);
    }

   private:
    friend class Peers;
    using Key = std::array<std::uint8_t, 16>;
    Place(Peers& peers, const Key& key) : peers_(&peers), key_(key) {}
    Peers* peers_ = nullptr;
    Key key_{};
  };

  /// None when the address has as many as it may, or where memory has ended. A Unix socket has no address:
  /// its file's permissions say who connects, and connections there are not counted. Of IPv6, the first 64
  /// bits are an address: the others are for their owner to choose.
  std::optional<Place> enter(const sockaddr* address, socklen_t length) noexcept;

  /// Addresses that are remembered: those with a connection, and those whose last ones began just now.
  std::size_t size() const;

 private:
  struct Peer {
    std::uint32_t connections = 0;
    Bucket begun;
  };
  struct Hash {
    std::size_t operator()(const Place::Key& key) const noexcept;
  };

  void leave(const Place::Key& key) noexcept;
  void forget() WARMFRONT_REQUIRES(mutex_);

  // Constant after construction.
  const std::uint32_t most_;
  const Bucket::Now now_;

  // Protected by mutex_.
  mutable Mutex mutex_;
  std::unordered_map<Place::Key, Peer, Hash> peers_ WARMFRONT_GUARDED_BY(mutex_);
  std::size_t forget_at_ WARMFRONT_GUARDED_BY(mutex_) = 1024;  ///< so many addresses
};

}  // namespace warmfront::server
