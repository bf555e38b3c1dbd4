// SPDX-License-Identifier: Apache-2.0
// Files that are appended to and that others of this machine may not read: they name sessions and principals.
#pragma once

#include <string>

#include "engine/result.h"

namespace warmfront::server {

/// A descriptor for appending, which the caller closes; a new file has the mode 0600. kInvalidArgument, in
/// words that begin with `setting` and name the system's reason, where it cannot be opened.
Result<int> open_private_file(const std::string& setting, const std::string& path);

}  // namespace warmfront::server
