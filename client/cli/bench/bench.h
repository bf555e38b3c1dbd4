// SPDX-License-Identifier: Apache-2.0
// The verb `bench`: the times of a step's stages, and the effect of each setting of the engine. Runs on one
// thread, and the engine's.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's options; `verb` must outlive the returned function.
Verb add_bench(CLI::App& verb);

}  // namespace warmfront::client
