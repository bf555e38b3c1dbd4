// SPDX-License-Identifier: Apache-2.0
// UUID syntax. Thread-safe.
#include "server/session/id.h"

namespace warmfront::server {

Outcome<SessionId> SessionId::parse(std::string_view text) {
  constexpr std::string_view kShape = "xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx";
  // Echoed in errors only up to its proper length: what a client sent may be long.
  const Fault fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                    "session_id: a UUID of 8-4-4-4-12 hexadecimal digits is expected, got " +
                        std::to_string(text.size()) + " bytes; choose a random one for each session"};
  if (text.size() != kShape.size()) return fault;
  std::string lowered(text);
  for (std::size_t i = 0; i < kShape.size(); ++i) {
    char& c = lowered[i];
    if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
    const bool hexadecimal = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
    if (kShape[i] == '-' ? c != '-' : !hexadecimal) return fault;
  }
  return SessionId(std::move(lowered));
}

}  // namespace warmfront::server
