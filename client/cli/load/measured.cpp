// SPDX-License-Identifier: Apache-2.0
// Interpretation of a load's figures: see measured.h.
#include "client/cli/load/measured.h"

#include <algorithm>
#include <cstdio>
#include <thread>

namespace warmfront::client::load {
namespace {

/// What is shown with one decimal, and longer than run() looks away.
constexpr double kLeastOutage = 0.05;

}  // namespace

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

std::string Measured::outage() const {
  if (unserved_seconds < kLeastOutage) return "";
  char text[200];
  std::snprintf(text, sizeof text,
                "no session had a daemon that served it for %.1f of the %.1f measured seconds: frames/s and "
                "contacts/s count this time in",
                unserved_seconds, seconds);
  return text;
}

}  // namespace warmfront::client::load
