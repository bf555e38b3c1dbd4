// SPDX-License-Identifier: Apache-2.0
// `warmfront detect`: steps through the frames of an input and reports the contacts. Used by the main thread
// only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_detect(CLI::App& app);

}  // namespace warmfront::client
