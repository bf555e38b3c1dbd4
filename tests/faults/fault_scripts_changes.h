// SPDX-License-Identifier: Apache-2.0
// Those of fault_scripts.h that change the scene between frames. Pure functions.
#pragma once

#include "tests/faults/fault_scripts.h"

namespace warmfront::testing::scripts {

Script changes();
Script changes_together();
Script filters();
Script options();
Script replacements();
Script replaced_locally();
Script replaced_whole();

}  // namespace warmfront::testing::scripts
