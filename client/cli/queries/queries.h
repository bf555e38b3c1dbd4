// SPDX-License-Identifier: Apache-2.0
// `warmfront queries`: elementary queries with known answers through one tier. Used by the main thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_queries(CLI::App& app);

}  // namespace warmfront::client
