// SPDX-License-Identifier: Apache-2.0
// The real warmfrontd in its own process, on a Unix socket and a loopback port. Used by one thread at a time.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {

/// Two threads, a JSON log, 64 MiB for messages in transit; killed at the end if it still runs.
class DaemonProcess {
 public:
  /// `flags` follow those above and override them; `environment` is added to this process' own, as
  /// NAME=VALUE. `log`: where its standard error goes instead of a file that log() reads.
  explicit DaemonProcess(std::vector<std::string> flags = {}, std::vector<std::string> environment = {},
                         std::string log = {});
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  /// unix:PATH, from the start.
  std::string socket() const;
  /// The loopback port, once the daemon listens; -1 when it does not in time.
  int port() const;
  /// The port of --metrics-listen 127.0.0.1:0, in the same way.
  int metrics_port() const;
  /// Other addresses it listens on appear here too.
  std::string log() const;
  pid_t pid() const { return pid_; }

  /// Memory in bytes: now, and the most since the start.
  std::size_t resident_bytes() const;
  std::size_t peak_bytes() const;
  /// What of its address space may be written to, which RLIMIT_DATA limits.
  std::size_t data_bytes() const;
  /// A line for each of its threads: name, state (R runs or wants to, S waits), nice value, seconds of a core
  /// that it has had, and the kernel's function that it waits in. Where an answer is missing, this tells a
  /// daemon that computes from one that hangs.
  std::string threads() const;
  /// Open files now.
  std::size_t open_files() const;
  /// The soft limit of setrlimit(), for the running process.
  void limit(int resource, std::size_t value) const;

  void start();
  /// SIGTERM, after the process has installed its handler: before that it would be killed.
  void terminate() const;
  void kill_hard();
  /// False once it has ended, also by itself.
  bool running() const;
  /// Waits for its end. False when that does not come in time.
  bool ends_within(std::chrono::seconds patience) const;
  /// The exit status as waitpid() gives it; -1 when the process does not end in time.
  int wait();

 private:
  bool hears(int signal) const;
  int port_after(const std::string& marker) const;
  std::size_t status_bytes(const char* field) const;

  const TemporaryFolder folder_;
  const std::vector<std::string> flags_;
  const std::vector<std::string> environment_;
  const std::string log_;
  pid_t pid_ = -1;
};

}  // namespace warmfront::test
