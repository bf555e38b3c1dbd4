// SPDX-License-Identifier: Apache-2.0
// `warmfront tangled INPUT`: which edges meet which faces, frame by frame; exit code 1 where any do.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

Verb add_tangled(CLI::App& app);

}  // namespace warmfront::client
