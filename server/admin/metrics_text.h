// SPDX-License-Identifier: Apache-2.0
// The metrics as Prometheus reads them. Thread-safe.
#pragma once

#include <cstdint>
#include <string>

#include "server/admin/metrics.h"

namespace warmfront::server {

/// What stands at one moment, and is not counted as it happens.
struct Gauges {
  std::uint64_t sessions = 0;
  std::uint64_t charged_bytes = 0;
  std::uint64_t max_bytes = 0;
  std::uint64_t open_streams = 0;
  std::uint64_t frames_in_flight = 0;
  std::uint64_t threads = 0;
  bool draining = false;
};

/// Prometheus' text format 0.0.4. Names begin with warmfront_ and end with their base unit; no label grows
/// with what clients do.
std::string metrics_text(const Metrics& metrics, const Gauges& gauges);

}  // namespace warmfront::server
