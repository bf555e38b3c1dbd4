// SPDX-License-Identifier: Apache-2.0
// What a configuration says that may not be meant, in words for the log. Thread-safe.
#pragma once

#include <string>
#include <vector>

#include "server/config.h"

namespace warmfront::server {

/// Settings that contradict one another: what a principal may have above what all may, and what is said of
/// principals where callers are not told apart.
std::vector<std::string> contradictions(const Config& config);

/// Settings of `read` with other values than `running`, which a daemon takes over when it starts again.
std::vector<std::string> not_in_force(const Config& running, const Config& read);

/// Why it would not, by what resolve_config() writes.
std::string would_not_start(std::string mistakes);

}  // namespace warmfront::server
