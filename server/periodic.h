// SPDX-License-Identifier: Apache-2.0
// What the daemon does periodically, each on a thread of its own until it is destroyed. What is given
// outlives it.
#pragma once

#include <functional>
#include <memory>

#include "server/auth/certificates.h"
#include "server/process/ticker.h"
#include "server/transport/context.h"

namespace warmfront::server {

/// Takes changed certificate files into force.
std::unique_ptr<Ticker> watch_certificates(std::shared_ptr<Certificates> certificates, Metrics& metrics);
/// Closes sessions that were idle for too long.
std::unique_ptr<Ticker> expire_sessions(Context& context);
/// Ends what is late: streams, uploads, connections that wait; `beat` is called each time.
std::unique_ptr<Ticker> enforce_timeouts(Context& context, std::function<void()> beat);
/// Gives freed memory back to the system, and logs the connections that were ended.
std::unique_ptr<Ticker> look_after_process(Context& context);

}  // namespace warmfront::server
