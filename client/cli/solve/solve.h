// SPDX-License-Identifier: Apache-2.0
// The verb `solve`: plays recorded frames as a solver's line search does. Used by the main thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Defines the verb's arguments. Exit codes: 0 played, 2 failed, 3 usage.
Verb add_solve(CLI::App& app);

}  // namespace warmfront::client
