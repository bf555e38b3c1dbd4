// SPDX-License-Identifier: Apache-2.0
// `warmfront accuracy`: the measured trade of speed for accuracy over query sets and scenes. Used by the main
// thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_accuracy(CLI::App& app);

}  // namespace warmfront::client
