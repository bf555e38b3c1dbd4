// SPDX-License-Identifier: Apache-2.0
// The metrics as Prometheus reads them. Thread-safe.
#pragma once

#include <cstdint>
#include <ctime>
#include <string>
#include <vector>

#include "server/observe/metrics.h"
#include "server/session/quota.h"

namespace warmfront::server {

/// What stands at one moment, and is not counted as it happens.
struct Gauges {
  std::uint64_t sessions = 0;
  std::uint64_t charged_bytes = 0;
  std::uint64_t max_bytes = 0;
  std::uint64_t open_streams = 0;
  std::uint64_t frames_in_flight = 0;
  std::uint64_t shared_bytes = 0;
  std::uint64_t threads = 0;
  bool draining = false;
  std::time_t certificate_expiry = 0;  ///< of the one in force; 0: none
  std::uint64_t traced_sent = 0;       ///< frames whose traces went out, ...
  std::uint64_t traced_dropped = 0;    ///< ... and did not
  /// A principal that has something in the daemon.
  struct Tenant {
    std::string name;
    std::uint64_t sessions = 0;
    std::uint64_t charged_bytes = 0;
    std::uint64_t open_streams = 0;
    std::uint64_t frames_in_flight = 0;
    std::uint64_t refused = 0;
    std::uint64_t steps = 0;
    double step_seconds = 0;
    Quota quota;
  };
  std::vector<Tenant> tenants = {};
};

/// Prometheus' text format 0.0.4. Names begin with warmfront_ and end with their base unit; no label grows
/// with what clients do, but for the principal's, of whom there are as many as tokens or certificates.
std::string metrics_text(const Metrics& metrics, const Gauges& gauges);

}  // namespace warmfront::server
