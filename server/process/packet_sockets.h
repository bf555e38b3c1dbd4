// SPDX-License-Identifier: Apache-2.0
// Unix sockets of packets beside gRPC's: what comes is told on threads of their own. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/result.h"
#include "server/annotations.h"
#include "server/process/packet_connection.h"
#include "server/process/reserve_threads.h"

namespace warmfront::server {

/// Told of connections; of one by one thread at a time.
class PacketReader {
 public:
  virtual ~PacketReader() = default;
  /// `packet` is valid until this returns. False: the connection ends.
  virtual bool packet(const std::shared_ptr<PacketConnection>& from, std::string_view packet) noexcept = 0;
  /// After Sent::kLater there is room again.
  virtual void has_room(const std::shared_ptr<PacketConnection>& on) noexcept = 0;
  /// It ended, from either end. The last that is told.
  virtual void lost(const std::shared_ptr<PacketConnection>& which) noexcept = 0;
};

class PacketSockets {
 public:
  /// Listens on `paths`, in place of what sockets are there, with the access that gRPC's own have. `greeter`
  /// is told of a connection until it stays, and outlives this. `threads` >= 2, and one in reserve; one waits
  /// for a connection's next packet for as long as `spin` before it sleeps, while another one remains and the
  /// machine has a second core.
  static Result<std::unique_ptr<PacketSockets>> listen(const std::vector<std::string>& paths, int threads,
                                                       PacketWait::Time spin, PacketReader& greeter);
  /// From now on connections are accepted, and told of.
  void begin();
  /// Waits for what is being told, and tells nobody any more. Once, or again.
  void end() noexcept;
  /// The same, and ends all connections.
  ~PacketSockets();
  PacketSockets(const PacketSockets&) = delete;
  PacketSockets& operator=(const PacketSockets&) = delete;

  /// Told of its first packet, a greeter says that the connection stays, and who is told of it from then on;
  /// it ends when there is no such reader any more. Others are ended kGreeting after they began, and
  /// kMostUnknown of them are there at most.
  void keep(PacketConnection& connection, std::weak_ptr<PacketReader> reader);

  static constexpr std::chrono::seconds kGreeting{5};
  static constexpr std::size_t kMostUnknown = 64;

 private:
  explicit PacketSockets(PacketReader& greeter) : greeter_(greeter) {}

  bool turn(ReserveThreads::Hand& hand, std::chrono::milliseconds most) noexcept;
  std::shared_ptr<PacketConnection> connection_of(std::uint64_t file) {
    const MutexLock lock(mutex_);
    const auto found = connections_.find(file);
    return found == connections_.end() ? nullptr : found->second;
  }
  void accept_from(int listener) noexcept;
  void tell(const std::shared_ptr<PacketConnection>& connection) noexcept;
  /// The next packet, if it comes while it is waited for without sleeping.
  std::optional<ssize_t> await(PacketConnection& connection, PacketConnection::When when,
                               std::span<char> room) noexcept;
  /// Who is told of it; null where there is nobody any more.
  std::shared_ptr<PacketReader> reader_of(const PacketConnection& connection);
  void forget(const std::shared_ptr<PacketConnection>& connection) noexcept;
  void drop_late() noexcept;

  PacketReader& greeter_;
  int threads_count_ = 0;
  PacketWait::Time spin_{0};
  std::shared_ptr<const int> poll_;
  int wake_ = -1;  // an eventfd: the threads end
  std::vector<int> listeners_;
  std::vector<std::string> paths_;
  std::atomic<int> spinning_{0};
  std::atomic<bool> without_files_{false};  // connections wait that could not be accepted

  Mutex mutex_;
  std::unordered_map<std::uint64_t, std::shared_ptr<PacketConnection>> connections_
      WARMFRONT_GUARDED_BY(mutex_);
  std::size_t unknown_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  std::chrono::steady_clock::time_point looked_ WARMFRONT_GUARDED_BY(mutex_) =
      std::chrono::steady_clock::now();

  std::optional<ReserveThreads> threads_;  // last: they use all of the above
};

}  // namespace warmfront::server
