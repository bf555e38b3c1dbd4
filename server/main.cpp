// SPDX-License-Identifier: Apache-2.0
// warmfrontd: reads its configuration, serves, reads its token file again on SIGHUP, and drains on SIGTERM or
// SIGINT. Exit codes: 0 drained, 2 failed (it could not listen, or frames in hand were cut off by the drain
// timeout), 3 usage, of a setting that can never serve too.
#include <absl/synchronization/mutex.h>
#include <grpc/grpc.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <exception>
#include <iostream>
#include <memory>
#include <semaphore>
#include <sstream>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "proto/command_line/baseline_build.h"
#include "server/config.h"
#include "server/config_remarks.h"
#include "server/daemon.h"
#include "server/log.h"
#include "server/observe/grpc_log.h"
#include "server/process/free_memory.h"
#include "server/process/guarded_receive.h"
#include "server/process/systemd.h"
#include "server/process/ticker.h"
#include "server/version.h"

namespace {

constexpr int kExitFailed = 2;
constexpr int kExitUsage = 3;

std::binary_semaphore drain_begins{0};

/// Ends the process when draining cannot, once drain_begins is released: a second signal, or a step that
/// outlasts `timeout`. The thread is made at the start: when the daemon is told to end, there may be no
/// memory for one.
void force_exit_after(const sigset_t& signals, std::chrono::milliseconds timeout) {
  std::thread([signals, timeout] {
    drain_begins.acquire();
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    for (;;) {
      const std::chrono::nanoseconds left = std::max(
          std::chrono::nanoseconds(0), std::chrono::nanoseconds(deadline - std::chrono::steady_clock::now()));
      const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
      const timespec wait{seconds.count(), static_cast<long>((left - seconds).count())};
      // Being stopped and continued, by a debugger say, interrupts the wait and is no reason to exit.
      if (sigtimedwait(&signals, nullptr, &wait) == -1 && errno == EINTR) continue;
      std::_Exit(kExitFailed);
    }
  }).detach();
}

/// A reload does not take settings over; who changed the file hears it. Without memory for it nobody does.
void log_what_is_not_in_force(int argc, char** argv, const warmfront::server::Config& running,
                              warmfront::server::Log& log) noexcept try {
  using namespace warmfront::server;
  std::ostringstream out, mistakes;
  const auto read = resolve_config(argc, argv, warmfront_variables(environ), out, mistakes);
  const auto* const resolved = std::get_if<ResolvedConfig>(&read);
  for (const std::string& reason : resolved == nullptr ? std::vector{would_not_start(mistakes.str())}
                                                       : not_in_force(running, resolved->config))
    log.write(LogLevel::kWarning, "configuration", {{"reason", reason}});
} catch (const std::exception&) {
}

}  // namespace

int main(int argc, char** argv) {
  using namespace warmfront::server;
  warmfront::command_line::become_baseline_build(argv);
  bound_free_memory();
  const auto resolved = resolve_config(argc, argv, warmfront_variables(environ), std::cout, std::cerr);
  if (const int* exit_code = std::get_if<int>(&resolved)) return *exit_code;
  const auto& [config, origins, print_only, remarks] = std::get<ResolvedConfig>(resolved);
  if (print_only) {
    std::cout << print_config(std::get<ResolvedConfig>(resolved));
    for (const std::string& remark : remarks) std::cerr << "warmfrontd: " << remark << "\n";
    return 0;
  }

  // Debian builds Abseil with its search for deadlocks on, which gRPC's locks would pay for: a twentieth of a
  // busy daemon's time.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);

  // Past a limit of the process's files (RLIMIT_FSIZE) a write fails, and so does shared memory: as on a full
  // disk, and not by the end of the daemon.
  signal(SIGXFSZ, SIG_IGN);

  // Blocked before any thread starts, so that all inherit it and only the waits below receive them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigset_t handled = signals;
  sigaddset(&handled, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &handled, nullptr);

  // A little more than the drain's own limit, which cuts off calls; this is for a step that cannot be cut
  // off.
  force_exit_after(signals, config.drain_timeout + std::chrono::seconds(1));

  // gRPC is never shut down, but ends with the process: where it could not make one of its threads, for want
  // of memory, it counts that thread all the same, and its shutdown would wait for it forever (1.51,
  // timer_manager.cc).
  grpc_init();

  // Never deleted: threads of gRPC may write to it until the process is gone.
  Log& log = *new Log(config.log_level, config.log_format);
  log_what_grpc_says(log);
  log.write(LogLevel::kInfo, "starting",
            {{"version", kVersion}, {"instructions", warmfront::instruction_sets()}});
  for (const std::string& remark : remarks)
    log.write(LogLevel::kWarning, "configuration", {{"reason", remark}});
  // Later than the daemon itself ends calls that it has begun: it tells the client.
  guard_connections({.max_metadata_bytes = config.max_metadata_bytes,
                     .max_streams = config.limits.max_streams_per_connection,
                     .first_message = config.limits.upload_timeout * 3 / 2 + std::chrono::seconds(1)},
                    config.max_connections_per_address);
  auto daemon = Daemon::start(config, log);
  if (!daemon) {
    log.write(LogLevel::kError, "failed", {{"reason", daemon.error().message}});
    return daemon.error().code == warmfront::ErrorCode::kInvalidArgument ? kExitUsage : kExitFailed;
  }
  notify_systemd("READY=1");
  // A daemon that hangs is started again; one that is only busy is not.
  std::unique_ptr<Ticker> watchdog;
  if (const auto interval = watchdog_interval())
    watchdog =
        std::make_unique<Ticker>(std::max(std::chrono::duration_cast<std::chrono::milliseconds>(*interval),
                                          std::chrono::milliseconds(1)),
                                 [&daemon] {
                                   if (daemon.value()->alive()) notify_systemd("WATCHDOG=1");
                                 });
  int signal = 0;
  while (sigwait(&handled, &signal) == 0 && signal == SIGHUP) {
    daemon.value()->reload();
    log_what_is_not_in_force(argc, argv, config, log);
  }
  drain_begins.release();
  notify_systemd("STOPPING=1");
  const bool delivered = daemon.value()->drain();
  watchdog.reset();
  daemon.value().reset();
  log.write(LogLevel::kInfo, "stopped");
  return delivered ? 0 : kExitFailed;
}
