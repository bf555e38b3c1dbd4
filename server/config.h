// SPDX-License-Identifier: Apache-2.0
// How warmfrontd is told what to do: flags, then environment (WARMFRONT_*), then a TOML file, then defaults.
// Plain values; the functions are thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "engine/result.h"
#include "server/auth/tls.h"
#include "server/log.h"
#include "server/observe/tracer.h"
#include "server/session/limits.h"

namespace warmfront::server {

struct Config {
  std::vector<std::string> listen{"127.0.0.1:50051"};
  bool insecure = false;            ///< listen beyond this machine without encryption
  TlsFiles tls;                     ///< of TCP addresses; Unix sockets stay plain
  std::string token_file;           ///< who may call; empty: whoever can connect
  std::vector<std::string> admins;  ///< principals that administer, besides those that the token file says
  std::vector<std::string> quotas;  ///< of principals, as parse_quotas() takes them
  bool reflection = false;          ///< serve grpc.reflection, so that generic tools can call the daemon
  bool no_shared_memory = false;    ///< offer none to clients of Unix sockets
  std::uint32_t spin_microseconds =
      50;                           ///< that a thread of shared memory waits for a frame before it sleeps
  bool channelz = false;            ///< serve grpc.channelz, which shows connections and calls
  std::string metrics_listen;       ///< HOST:PORT of /metrics, /healthz and /readyz; empty: none
  std::string record_dir;           ///< where sessions are recorded; empty: nowhere
  std::size_t record_max_bytes = std::size_t{1} << 30;     ///< that recordings in it may hold
  std::size_t record_queue_bytes = std::size_t{64} << 20;  ///< of recordings, that wait for the disk
  int threads = 0;  ///< that steps run on; 0: as many as the machine has
  LogLevel log_level = LogLevel::kInfo;
  LogFormat log_format = LogFormat::kText;
  TraceSettings trace;     ///< of frames, for OpenTelemetry; off unless it says where traces go
  std::string audit_file;  ///< what administrators do is appended to it; empty: to the log alone
  Limits limits;
  std::size_t transport_memory_bytes = std::size_t{1} << 30;  ///< gRPC's ResourceQuota: messages in transit
  std::uint32_t max_metadata_bytes = 16 << 10;                ///< headers of a call
  std::uint32_t max_connections_per_address = 512;            ///< of TCP; 0: as many as there are files
  std::chrono::milliseconds drain_timeout = std::chrono::seconds(30);
};

/// Where a setting's value came from.
enum class Origin : std::uint8_t { kDefault, kFile, kEnvironment, kFlag };

struct ResolvedConfig {
  Config config;
  std::vector<Origin> origins;       ///< of the settings, in the order of the table
  bool print_only = false;           ///< --print-config
  std::vector<std::string> remarks;  ///< on what is no mistake and may not be meant, for the log
};

/// Variables by name.
using Environment = std::map<std::string, std::string>;

/// Those of a process (environ(7)) that begin with WARMFRONT_.
Environment warmfront_variables(const char* const* variables);

/// The configuration, or the exit code of a process that is done: 0 after --help or --version, 3 for a
/// mistake. Help goes to `out`, mistakes to `err`; they name the flag, variable or file and key. A variable
/// WARMFRONT_* that is no setting is a mistake where its name is near a setting's, and a remark where it is
/// not: Kubernetes makes such variables of services, and our proxy's configuration and tests have some.
std::variant<ResolvedConfig, int> resolve_config(int argc, const char* const* argv,
                                                 const Environment& environment, std::ostream& out,
                                                 std::ostream& err);

/// TOML that --config reads again, each setting with a comment that says where its value came from.
std::string print_config(const ResolvedConfig& resolved);

}  // namespace warmfront::server
