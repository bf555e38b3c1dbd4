// SPDX-License-Identifier: Apache-2.0
// Reading the session's id. Thread-safe.
#include "server/transport/session_metadata.h"

namespace warmfront::server {

std::string session_metadata(const grpc::ServerContextBase& call) {
  const auto found = call.client_metadata().find(kSessionMetadata);
  if (found == call.client_metadata().end()) return {};
  return {found->second.data(), found->second.size()};
}

Outcome<SessionId> session_id_of(std::string_view message, std::string_view metadata) {
  Outcome<SessionId> id = SessionId::parse(message.empty() ? metadata : message);
  if (!id || metadata.empty()) return id;
  const Outcome<SessionId> other = SessionId::parse(metadata);
  if (!other || other.value() != id.value())
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "session_id: the message names another session than the metadata warmfront-session; send "
                 "one of them"};
  return id;
}

}  // namespace warmfront::server
