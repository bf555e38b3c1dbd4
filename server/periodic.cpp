// SPDX-License-Identifier: Apache-2.0
#include "server/periodic.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "server/process/accept.h"
#include "server/process/free_memory.h"
#include "server/process/guarded_receive.h"

namespace warmfront::server {
namespace {

using std::chrono::milliseconds;

/// How often freed memory is looked for, and connections that were ended are logged.
constexpr milliseconds kGlanceAtProcess{1000};
/// How often certificate files are looked at.
constexpr milliseconds kCertificateGlance{500};
struct ConnectionCounts {
  std::array<std::uint64_t, Http2Guard::kVerdicts> ended = connections_ended();
  std::uint64_t refused = connections_refused();
  std::uint64_t without_files = connections_without_files();
};

/// One line for those that were ended since `seen`, and one for each reason to refuse them; `seen` is brought
/// up to date. Whoever floods the daemon does not flood its log.
void log_connections(Log& log, ConnectionCounts& seen) {
  const ConnectionCounts counts;
  const auto& now = counts.ended;
  std::string reasons;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] == seen.ended[i]) continue;
    count += now[i] - seen.ended[i];
    if (!reasons.empty()) reasons.push_back(' ');
    reasons.append(Http2Guard::kNames[i]);
  }
  if (count > 0) log.write(LogLevel::kWarning, "connections_ended", {{"count", count}, {"reason", reasons}});
  if (counts.refused > seen.refused)
    log.write(LogLevel::kWarning, "connections_refused",
              {{"count", counts.refused - seen.refused}, {"reason", "max-connections-per-address"}});
  if (counts.without_files > seen.without_files)
    log.write(LogLevel::kWarning, "connections_refused",
              {{"count", counts.without_files - seen.without_files},
               {"reason",
                "no file descriptor is left; raise the limit (ulimit -n, LimitNOFILE; the system's: "
                "fs.file-max)"}});
  seen = counts;
}

/// How often to look for what has outlived `timeout`, so that it does by a quarter at most.
milliseconds period_for(milliseconds timeout, milliseconds most) {
  return std::clamp(timeout / 4, milliseconds(10), most);
}

void close_idle_sessions(Context& context) {
  for (const std::shared_ptr<Session>& session : context.store.remove_idle(context.limits.idle_timeout)) {
    session->close_as("expired");
    ++context.metrics.sessions_ended[Metrics::kExpired];
    context.log.write(LogLevel::kInfo, "session_closed",
                      {{"session", session->id().text()}, {"reason", "idle"}});
  }
}

}  // namespace

std::unique_ptr<Ticker> watch_certificates(std::shared_ptr<Certificates> certificates, Metrics& metrics) {
  return std::make_unique<Ticker>(kCertificateGlance, [files = std::move(certificates), &metrics] {
    if (!files->look()) ++metrics.reload_failures[Metrics::kCertificates];
  });
}

std::unique_ptr<Ticker> expire_sessions(Context& context) {
  return std::make_unique<Ticker>(period_for(context.limits.idle_timeout, milliseconds(10'000)),
                                  [&context] { close_idle_sessions(context); });
}

std::unique_ptr<Ticker> enforce_timeouts(Context& context, std::function<void()> beat) {
  const milliseconds least = std::min(context.limits.upload_timeout, context.limits.write_stall_timeout);
  return std::make_unique<Ticker>(period_for(least, milliseconds(1000)), [&context, beat = std::move(beat)] {
    context.lifecycle.enforce_timeouts();
    refuse_connections_left_waiting();
    beat();
  });
}

std::unique_ptr<Ticker> look_after_process(Context& context) {
  return std::make_unique<Ticker>(
      kGlanceAtProcess, [&context, free_memory = FreeMemory(), counts = ConnectionCounts()]() mutable {
        log_connections(context.log, counts);
        const std::size_t bytes = give_back_free_memory(free_memory);
        if (bytes == 0) return;
        context.metrics.memory_given_back += bytes;
        context.log.write(LogLevel::kDebug, "memory_given_back", {{"bytes", std::uint64_t{bytes}}});
      });
}

}  // namespace warmfront::server
