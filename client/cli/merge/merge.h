// SPDX-License-Identifier: Apache-2.0
// `warmfront merge`: joins the reports of `detect --frames` over ranges of one input. Used by the main thread
// only.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's arguments to `app` and gives what it does.
Verb add_merge(CLI::App& app);

}  // namespace warmfront::client
