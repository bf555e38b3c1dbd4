// SPDX-License-Identifier: Apache-2.0
// A helping thread's courtesy. Thread-safe.
#pragma once

namespace warmfront {

/// Lets another thread have the core if the calling one helps in a call that is to give way: see
/// Workers::give_way_while(). Defined in workers.cpp.
void give_way();

}  // namespace warmfront
