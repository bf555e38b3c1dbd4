// SPDX-License-Identifier: Apache-2.0
// One connection of packets (SOCK_SEQPACKET). A packet is what the kernel copied: nobody changes it any more.
// Thread-safe.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "server/annotations.h"
#include "server/process/packet_wait.h"

namespace warmfront::server {

class PacketReader;
class PacketSockets;

/// As epoll_ctl(2): `poll` tells of `file` as `which`. False: errno says why not.
bool arm_in_epoll(int poll, int operation, int file, std::uint32_t events, std::uint64_t which) noexcept;

class PacketConnection : public std::enable_shared_from_this<PacketConnection> {
 public:
  /// Longer packets are a mistake of who sends them, and end the connection.
  static constexpr std::size_t kMostBytes = 61'440;

  enum class Sent : std::uint8_t {
    kWhole,
    kLater,  ///< there is no room: the reader hears when there is
    kLost,   ///< the connection is gone
  };

  PacketConnection(int file, std::shared_ptr<const int> poll);
  ~PacketConnection();
  PacketConnection(const PacketConnection&) = delete;
  PacketConnection& operator=(const PacketConnection&) = delete;

  /// One packet, with a file's descriptor unless it is -1. Does not wait.
  Sent send(std::span<const std::string_view> pieces, int file = -1) noexcept;
  using When = PacketWait::When;
  /// The next packet is wanted: one is told, then no other until this is called again. In what is told of a
  /// packet it costs nothing.
  void want_packet(When when = When::kLater) noexcept;
  /// Ends it; what was sent can still be received by the other end.
  void shut() noexcept;

 private:
  friend class PacketSockets;

  enum : std::uint32_t { kPacket = 1, kRoom = 2 };
  void arm_locked() noexcept WARMFRONT_REQUIRES(mutex_);
  /// The bytes of the next packet, <= 0 when there are no more; none while it has not come.
  std::optional<ssize_t> receive_now(std::span<char> room) noexcept;

  const int file_;
  const std::shared_ptr<const int> poll_;
  const std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
  std::atomic<bool> known_{false};  // it stays

  Mutex mutex_;
  std::uint32_t wanted_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  When when_ WARMFRONT_GUARDED_BY(mutex_) = When::kLater;  // of a packet that is wanted
  bool told_ WARMFRONT_GUARDED_BY(mutex_) = false;  // a thread is telling of it, and looks at wanted_ then

  // Of the thread that tells.
  std::weak_ptr<PacketReader> reader_;  // once it stays
  PacketWait wait_;
};

}  // namespace warmfront::server
