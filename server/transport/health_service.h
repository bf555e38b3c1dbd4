// SPDX-License-Identifier: Apache-2.0
// grpc.health.v1.Health, which asks nobody who they are, and so holds little for whoever calls. Its messages
// have a field each and are read and written here. Thread-safe.
#pragma once

#include <grpcpp/impl/codegen/service_type.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "server/annotations.h"

namespace warmfront::server {

/// Check and Watch as gRPC's own service has them, of the whole daemon (an empty name) and of `service_name`;
/// but for watches: where there are `most_watches`, a new one ends the oldest, with UNAVAILABLE, once that
/// has had `watch_time`; before, the new one is RESOURCE_EXHAUSTED.
class HealthService final : public grpc::Service {
 public:
  static constexpr std::size_t kMostWatches = 256;
  static constexpr std::chrono::seconds kWatchTime{60};

  explicit HealthService(std::string service_name, std::size_t most_watches = kMostWatches,
                         std::chrono::milliseconds watch_time = kWatchTime);
  ~HealthService() override;

  /// SERVING from now on; until then the daemon is, and the service is unknown.
  void serve();
  /// NOT_SERVING from now on.
  void stop();

 private:
  enum class State : std::uint8_t { kStarting, kServing, kStopping };
  enum Answer : char { kUnknown = 0, kServing = 1, kNotServing = 2, kServiceUnknown = 3 };
  class Watch;

  Answer answer_to(std::string_view name) const WARMFRONT_REQUIRES(mutex_);
  Answer check(std::string_view name) const;
  std::shared_ptr<Watch> watch(std::string name);
  void remove(std::uint64_t key);
  void set(State state);

  // Constant after construction.
  const std::string service_name_;
  const std::size_t most_watches_;
  const std::chrono::milliseconds watch_time_;

  // Protected by mutex_. Watches by age.
  mutable Mutex mutex_;
  State state_ WARMFRONT_GUARDED_BY(mutex_) = State::kStarting;
  std::uint64_t next_key_ WARMFRONT_GUARDED_BY(mutex_) = 0;
  std::map<std::uint64_t, std::shared_ptr<Watch>> watches_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
