// SPDX-License-Identifier: Apache-2.0
// `warmfront scene`: writes a built-in scene as mesh, cache and bodies. Used by the main thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_scene(CLI::App& app);

}  // namespace warmfront::client
