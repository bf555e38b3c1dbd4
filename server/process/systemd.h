// SPDX-License-Identifier: Apache-2.0
// Telling systemd how the daemon is: the datagrams of sd_notify(3). Thread-safe.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace warmfront::server {

/// Sends `state`, e.g. "READY=1", to the socket that NOTIFY_SOCKET names. False where there is none or it
/// does not take it at once: a daemon without systemd goes on.
bool notify_systemd(const std::string& state);

/// How often the watchdog that systemd keeps for this process must be fed; nothing when there is none.
std::optional<std::chrono::microseconds> watchdog_interval();

}  // namespace warmfront::server
