// SPDX-License-Identifier: Apache-2.0
// What gRPC says of itself (handshakes that failed, ports that it did not get) joins the daemon's log.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "server/log.h"

namespace warmfront::server {

/// Events named "grpc" from now on, of the level that GRPC_VERBOSITY allows (errors by default), and
/// "handshake_failed", with what is likely to be wrong, for TLS connections that did not come about. The same
/// words come once a second at most. For all of the process; `log` outlives it. Thread-safe.
void log_what_grpc_says(Log& log);

/// What a failed TLS handshake is likely to come from, by gRPC's (OpenSSL's) words; empty for words that are
/// not of a failed handshake. Thread-safe.
std::string_view why_handshake_failed(std::string_view said);

/// Lets the same words through once a second: whoever floods the daemon does not flood its log. Different
/// words may count as the same, and rarely do; all together come sixteen times a second at most. Not
/// thread-safe.
class Repeats {
 public:
  /// How often these words were left out since they last came through; nothing when they are left out now.
  std::optional<std::uint64_t> admit(std::string_view words, std::chrono::steady_clock::time_point now);

 private:
  struct Place {
    std::optional<std::chrono::steady_clock::time_point> last;
    std::uint64_t left_out = 0;
  };
  std::array<Place, 16> places_{};
};

}  // namespace warmfront::server
