// SPDX-License-Identifier: Apache-2.0
// A client's connections: as many as its calls need. Thread-safe.
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

/// A connection carries a limited number of calls at once (HTTP/2's SETTINGS_MAX_CONCURRENT_STREAMS); gRPC
/// lets a call beyond it wait, without a word, until another ends, and a session's stream does not end. So
/// calls are counted, and one that no connection has room for gets another connection.
class ChannelPool {
 public:
  /// Where no daemon has said how many: half of what daemons allow by default, and below what proxies do (100
  /// in HAProxy).
  static constexpr std::uint32_t kMostCalls = 64;

  struct Channel {
    std::shared_ptr<grpc::Channel> channel;
    std::unique_ptr<v1::CollisionService::Stub> service;
    std::unique_ptr<v1::AdminService::Stub> admin;
    std::uint32_t calls = 0;  ///< under way; under the pool's lock
  };

  /// Room for one call on a channel until it is destroyed. Movable; outlived by the pool.
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

  /// `open` makes a channel with a connection of its own.
  explicit ChannelPool(std::function<std::shared_ptr<grpc::Channel>()> open) : open_(std::move(open)) {}

  Lease take();
  /// What a daemon says that a connection carries; 0: it does not say. Above kMostCalls a connection is not
  /// filled: it is bound to about one core.
  void set_calls_per_channel(std::uint32_t most);

 private:
  // Constant after construction.
  const std::function<std::shared_ptr<grpc::Channel>()> open_;

  // Protected by mutex_. Channels stay: gRPC itself closes connections that have been idle for half an hour.
  std::mutex mutex_;
  std::uint32_t most_calls_ = 1;  // until a daemon has been asked
  std::vector<std::unique_ptr<Channel>> channels_;
};

}  // namespace warmfront::client
