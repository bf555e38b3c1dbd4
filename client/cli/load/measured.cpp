// SPDX-License-Identifier: Apache-2.0
// Interpretation of a load's figures: see measured.h.
#include "client/cli/load/measured.h"

#include <algorithm>
#include <cstdio>
#include <thread>

namespace warmfront::client::load {

double Measured::kept_pace() const {
  const std::uint64_t due = tally.frames + tally.unsent;
  return due == 0 ? 1 : static_cast<double>(tally.frames) / static_cast<double>(due);
}

std::string Measured::client_limit() const {
  char text[160];
  const double late = tally.own_late.quantile(0.99);
  if (late > 1 && late > 0.1 * tally.latency.quantile(0.99)) {
    std::snprintf(text, sizeof text, "this process was late by itself: %.1f ms at p99 of %.1f ms", late,
                  tally.latency.quantile(0.99));
    return text;
  }
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  if (client_cpu_cores > 0.9 * cores) {
    std::snprintf(text, sizeof text, "this process used %.1f of %u cores", client_cpu_cores, cores);
    return text;
  }
  return "";
}

}  // namespace warmfront::client::load
