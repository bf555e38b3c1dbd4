// SPDX-License-Identifier: Apache-2.0
// `warmfront near INPUT --distance D`: the pairs of features that are within a distance of each other, frame
// by frame.
#pragma once

#include "client/cli/verb.h"

namespace warmfront::client {

Verb add_near(CLI::App& app);

}  // namespace warmfront::client
