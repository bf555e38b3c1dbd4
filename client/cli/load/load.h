// SPDX-License-Identifier: Apache-2.0
// `warmfront load`: streams many sessions to a daemon, and measures latency and throughput. Used by the main
// thread only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_load(CLI::App& app);

}  // namespace warmfront::client
