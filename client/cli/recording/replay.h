// SPDX-License-Identifier: Apache-2.0
// `warmfront replay`: steps through a recorded session again and compares the answers. Used by the main
// thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_replay(CLI::App& app);

}  // namespace warmfront::client
