// SPDX-License-Identifier: Apache-2.0
// Ending a session on request. Thread-safe.
#pragma once

#include <memory>
#include <string>

#include "server/transport/context.h"
#include "server/transport/reaction.h"

namespace warmfront::server {

/// `reason` is for the log.
inline void delete_session(Context& context, std::shared_ptr<Session> session, const std::string& reason) {
  context.store.forget(*session);
  session->close_as("was deleted");
  ++context.metrics.sessions_ended[Metrics::kDeleted];
  if_memory_allows([&] {
    context.log.write(
        LogLevel::kInfo, "session_closed",
        {{"session", session->id().text()}, {"principal", session->owner()}, {"reason", reason}});
  });
  // A large session takes a while to free: not in a reaction, unless there is no memory to post it with.
  if_memory_allows([&] { context.runner.post([doomed = std::move(session)] {}); });
}

}  // namespace warmfront::server
