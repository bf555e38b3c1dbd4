// SPDX-License-Identifier: Apache-2.0
// The stage that computes the fields of contacts that were asked for.
#pragma once

#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

/// Writes the geometry of core.found()'s contacts, or empties it where no field was asked for. Parallel,
/// inside Workers::run(). Throws Stopped when told to stop.
void compute_contact_fields(Core& core, StopSignal stop);

}  // namespace warmfront
