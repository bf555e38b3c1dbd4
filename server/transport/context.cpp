// SPDX-License-Identifier: Apache-2.0
// Thread safety as stated in the header.
#include "server/transport/context.h"

#include <string>

#include "server/transport/call_tag.h"
#include "server/transport/reaction.h"

namespace warmfront::server {

Outcome<Principal> Context::identify(const grpc::ServerContextBase& call) {
  Outcome<Principal> principal = guard.identify(call);
  if (principal) return principal;
  if_memory_allows([&] {
    const std::string peer = call.peer(), host = peer.substr(0, peer.rfind(':'));
    // From one place once a second: who guesses tokens fills no disk.
    const auto left_out = unknown_callers.admit(host);
    if (!left_out) return;
    log.write(LogLevel::kWarning, "unauthenticated",
              {{"peer", peer},
               {"reason", principal.fault().message},
               {"request_id", call_tag(call).request_id},
               {"left_out", *left_out}});
  });
  return principal;
}

}  // namespace warmfront::server
