// SPDX-License-Identifier: Apache-2.0
// `warmfront sessions`: lists, shows and closes the sessions of a daemon. Used by the main thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_sessions(CLI::App& app);

}  // namespace warmfront::client
