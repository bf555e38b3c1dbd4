// SPDX-License-Identifier: Apache-2.0
// The verb `bench`: where a step's time goes, and what each setting of the engine changes about it. Runs on
// one thread, and the engine's.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

/// Adds the verb's options; `verb` must outlive what is given back.
Verb add_bench(CLI::App& verb);

}  // namespace warmfront::client
