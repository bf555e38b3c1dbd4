// SPDX-License-Identifier: Apache-2.0
// A client's connections, as many as its calls need. Thread-safe.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "warmfront/v1/admin_service.grpc.pb.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::client {

/// A connection carries a limited number of concurrent calls (HTTP/2's SETTINGS_MAX_CONCURRENT_STREAMS); gRPC
/// silently queues further calls until another ends, and a session's stream does not end. So calls are
/// counted, and a new connection is opened when all are full.
class ChannelPool {
 public:
  /// Default if the daemon states no number: half of a daemon's default, and below that of proxies (100 in
  /// HAProxy).
  static constexpr std::uint32_t kMostCalls = 64;

  struct Channel {
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<v1::CollisionService::Stub> service;
    std::unique_ptr<v1::AdminService::Stub> admin;
    std::uint32_t calls = 0;  ///< running; protected by the pool's lock
  };

  /// Reserves one call on a channel until destroyed. Movable; the pool must outlive it.
  class Lease {
   public:
    Lease(ChannelPool& pool, Channel& channel) : pool_(&pool), channel_(&channel) {}
    Lease(Lease&& other) noexcept : pool_(other.pool_), channel_(std::exchange(other.channel_, nullptr)) {}
    Lease& operator=(Lease&&) = delete;
    ~Lease();
    Channel* operator->() const { return channel_; }

   private:
    ChannelPool* pool_;
    Channel* channel_;
  };

  /// `open` creates a channel with its own connection.
  explicit ChannelPool(std::function<std::shared_ptr<grpc::Channel>()> open) : open_(std::move(open)) {}

  Lease take();
  /// The daemon's limit of calls per connection; 0: unknown. At most kMostCalls are used, since a connection
  /// is bound to about one core.
  void set_calls_per_channel(std::uint32_t most);

 private:
  // Constant after construction.
  const std::function<std::shared_ptr<grpc::Channel>()> open_;

  // Protected by mutex_. Channels are kept: gRPC itself closes connections after half an hour idle.
  std::mutex mutex_;
  std::uint32_t most_calls_ = 1;  // until a daemon has stated its limit
  std::vector<std::unique_ptr<Channel>> channels_;
};

}  // namespace warmfront::client
