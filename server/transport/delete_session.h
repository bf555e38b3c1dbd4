// SPDX-License-Identifier: Apache-2.0
// Ending a session on request. Thread-safe.
#pragma once

#include <memory>
#include <string>

#include "server/transport/context.h"

namespace warmfront::server {

/// `reason` is for the log.
inline void delete_session(Context& context, std::shared_ptr<Session> session, const std::string& reason) {
  context.store.forget(*session);
  session->close({ErrorCode::kNotFound, Reason::kSessionNotFound,
                  "session " + session->id().text() + " was deleted; create it again"});
  ++context.metrics.sessions_ended[Metrics::kDeleted];
  context.log.write(LogLevel::kInfo, "session_closed",
                    {{"session", session->id().text()}, {"principal", session->owner()}, {"reason", reason}});
  // A large session takes a while to free: not in a reaction.
  context.runner.post([doomed = std::move(session)] {});
}

}  // namespace warmfront::server
