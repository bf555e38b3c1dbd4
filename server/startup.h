// SPDX-License-Identifier: Apache-2.0
// What a daemon's configuration names outside of it, looked at before anything is served and at a reload.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/result.h"
#include "server/auth/certificates.h"
#include "server/auth/guard.h"
#include "server/config.h"
#include "server/log.h"
#include "server/process/socket_lock.h"

namespace warmfront::server {

/// The locks of the Unix sockets that are listened on. kInvalidArgument for what is no address, or one that
/// the configuration does not allow; kFailedPrecondition where another process has it.
Result<std::vector<SocketLock>> lock_addresses(const Config& config);

/// Null without TLS.
Result<std::shared_ptr<Certificates>> certificates_of(const Config& config, Log& log);

/// Once at each start: a token or key that every user may read is theirs as well.
void warn_of_readable_secrets(Log& log, const Config& config);

/// At each start and reload: a name that nobody has may be a mistake in writing.
void warn_of_principals_without_token(Log& log, const std::vector<std::string>& principals);

/// For the log.
std::string what_is_read_again(const Guard& guard, bool certificates);

/// Once at each start, where the machine lacks what the build's hot loops are for.
void warn_of_slow_instructions(Log& log);

}  // namespace warmfront::server
