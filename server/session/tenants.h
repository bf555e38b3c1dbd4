// SPDX-License-Identifier: Apache-2.0
// The principals that have something in the daemon, each with what it may have and what it has. Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/annotations.h"
#include "server/fault.h"
#include "server/session/account.h"
#include "server/session/gate.h"
#include "server/session/quota.h"
#include "server/session/share.h"

namespace warmfront::server {

/// One principal. Its gates lie within the daemon's.
class Tenant {
 public:
  Tenant(std::string the_name, const Quota& quota, Gate& all_streams, Gate& all_frames);

  void set_quota(const Quota& quota);
  /// As it is in force.
  Quota quota() const;
  /// Sessions that it may have.
  std::uint32_t max_sessions() const { return max_sessions_.load(std::memory_order_relaxed); }

  const std::string name;
  Budget memory;
  Gate streams;
  Gate frames;
  Gate uploads;
  Share share;
  /// Creates, attaches and frames of its that were refused.
  std::atomic<std::uint64_t> refused{0};
  /// Steps of its sessions, and how long they took in the engine.
  std::atomic<std::uint64_t> steps{0};
  std::atomic<std::uint64_t> step_nanoseconds{0};

 private:
  std::atomic<std::uint32_t> max_sessions_;
};

/// Why a gate of a tenant, or of the daemon, lets none in: `what` there are too many of, e.g. "streams open",
/// and the settings of the daemon's limit and of the principal's.
Fault gate_met(const Gate& of_tenant, const Gate& of_daemon, const std::string& call, const char* what,
               const char* setting, const char* quota);

class Tenants {
 public:
  /// `for_all` is the quota of those of whom nothing is said. The gates outlive this and all tenants.
  Tenants(const Quota& for_all, Gate& all_streams, Gate& all_frames)
      : for_all_(for_all), all_streams_(all_streams), all_frames_(all_frames) {}

  /// Kept for as long as something of it lives.
  std::shared_ptr<Tenant> of(const std::string& principal);
  /// What is said of some, from now on; what they have already stays.
  void set_quotas(Quotas quotas);
  /// Those that live, by their names.
  std::vector<std::shared_ptr<Tenant>> list() const;

 private:
  Quota quota_of(const std::string& principal) const WARMFRONT_REQUIRES(mutex_);

  // Constant after construction.
  const Quota for_all_;
  Gate& all_streams_;
  Gate& all_frames_;

  mutable Mutex mutex_;
  Quotas quotas_ WARMFRONT_GUARDED_BY(mutex_);
  std::map<std::string, std::weak_ptr<Tenant>> tenants_ WARMFRONT_GUARDED_BY(mutex_);
};

}  // namespace warmfront::server
