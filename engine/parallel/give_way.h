// SPDX-License-Identifier: Apache-2.0
// Letting others have the core. Thread-safe.
#pragma once

namespace warmfront {

/// Lets another thread have the core, once a millisecond, if the calling one works on a call that is to give
/// way: see Workers::give_way_while(). Defined in workers.cpp.
void give_way();

}  // namespace warmfront
