// SPDX-License-Identifier: Apache-2.0
// Reading the small files that a daemon is told by. Thread-safe.
#pragma once

#include <string>

#include "engine/result.h"

namespace warmfront::server {

/// What a regular file of at most 1 MiB holds. INVALID_ARGUMENT, beginning with `what` and the path, for
/// anything else: a device or a pipe could end never, or keep the daemon from hearing its signals. A file
/// that changes while it is read is read again, for up to two seconds; then it is UNAVAILABLE: who writes it
/// should write another beside it and rename that.
Result<std::string> read_small_file(const std::string& what, const std::string& path);

/// Whether every user of this machine may read the file; its group alone is no such user. False for one that
/// is not there.
bool is_readable_by_others(const std::string& path);

}  // namespace warmfront::server
