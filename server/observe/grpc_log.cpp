// SPDX-License-Identifier: Apache-2.0
// gRPC's log function. Thread safety as stated in the header.
#include "server/observe/grpc_log.h"

#include <grpc/support/log.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "server/observe/repeats.h"

namespace warmfront::server {
namespace {

std::atomic<Log*> target{nullptr};

/// Never deleted: threads of gRPC may speak until the process is gone.
Repeats& repeats() {
  static Repeats& one = *new Repeats;
  return one;
}

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

void write(Log& log, const gpr_log_func_args& said) noexcept try {
  const std::string_view words = said.message;
  std::optional<std::uint64_t> left_out = 0;
  // What somebody turned on to search for a fault is wanted whole.
  if (said.severity == GPR_LOG_SEVERITY_ERROR) left_out = repeats().admit(words);
  if (!left_out) return;
  const std::string where = std::string(said.file) + ":" + std::to_string(said.line);
  if (const std::string_view why = why_handshake_failed(words); !why.empty())
    log.write(level_of(said.severity), "handshake_failed",
              {{"reason", std::string(why)},
               {"said", std::string(words)},
               {"where", where},
               {"left_out", *left_out}});
  else
    log.write(level_of(said.severity), "grpc",
              {{"said", std::string(words)}, {"where", where}, {"left_out", *left_out}});
} catch (const std::exception&) {
  // Without memory for a line there is none: gRPC, in whose midst this is, cannot be left by an exception.
}

}  // namespace

std::string_view why_handshake_failed(std::string_view said) {
  if (!said.starts_with("Handshake failed")) return {};
  constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kReasons{{
      {"peer did not return a certificate",
       "the client showed no certificate, which --tls-client-ca asks for"},
      {"certificate verify failed",
       "the client's certificate has expired, or none of --tls-client-ca signed it"},
      {"wrong version number",
       "the client does not speak TLS; give it the daemon's CA (our clients: --tls-ca)"},
      {"http request", "the client speaks HTTP without TLS; give it the daemon's CA (our clients: --tls-ca)"},
      {"unknown ca", "the client does not trust the daemon's certificate; give it the CA that signed it"},
      {"bad certificate", "the client refused the daemon's certificate: its names, its dates or its signer"},
      {"certificate expired", "the client refused the daemon's certificate: it has expired"},
      {"unsupported protocol", "the client's TLS is older than 1.2"},
  }};
  for (const auto& [words, reason] : kReasons)
    if (said.find(words) != std::string_view::npos) return reason;
  return "the client and the daemon could not agree on TLS";
}

void log_what_grpc_says(Log& log) {
  target.store(&log);
  gpr_set_log_function([](gpr_log_func_args* said) { write(*target.load(), *said); });
}

}  // namespace warmfront::server
