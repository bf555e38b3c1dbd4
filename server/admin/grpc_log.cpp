// SPDX-License-Identifier: Apache-2.0
// gRPC's log function. Thread safety as stated in the header.
#include "server/admin/grpc_log.h"

#include <grpc/support/log.h>

#include <atomic>
#include <string>

namespace warmfront::server {
namespace {

std::atomic<Log*> target{nullptr};

/// Its errors are mostly what some client did: what the daemon itself fails at has an event of its own.
LogLevel level_of(gpr_log_severity severity) {
  switch (severity) {
    case GPR_LOG_SEVERITY_DEBUG:
      return LogLevel::kDebug;
    case GPR_LOG_SEVERITY_INFO:
      return LogLevel::kInfo;
    case GPR_LOG_SEVERITY_ERROR:
      break;
  }
  return LogLevel::kWarning;
}

}  // namespace

void log_what_grpc_says(Log& log) {
  target.store(&log);
  gpr_set_log_function([](gpr_log_func_args* said) {
    target.load()->write(level_of(said->severity), "grpc",
                         {{"said", std::string(said->message)},
                          {"where", std::string(said->file) + ":" + std::to_string(said->line)}});
  });
}

}  // namespace warmfront::server
