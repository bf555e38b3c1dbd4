// SPDX-License-Identifier: Apache-2.0
// `warmfront accuracy`: measures speed against accuracy over query sets and scenes. Used by the main thread
// only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and returns the function that runs it.
Verb add_accuracy(CLI::App& app);

}  // namespace warmfront::client
