// SPDX-License-Identifier: Apache-2.0
// The session that a call is about: named in its message, in its metadata for proxies, or both. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>

#include <string>
#include <string_view>

#include "server/session/id.h"

namespace warmfront::server {

inline constexpr const char* kSessionMetadata = "warmfront-session";

/// The value of the metadata, or "".
std::string session_metadata(const grpc::ServerContextBase& call);

/// The message's id, or the metadata's when that is empty. INVALID_ARGUMENT when both are given and differ.
Outcome<SessionId> session_id_of(std::string_view message, std::string_view metadata);

}  // namespace warmfront::server
