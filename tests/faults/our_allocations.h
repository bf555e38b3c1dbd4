// SPDX-License-Identifier: Apache-2.0
// Makes the n-th allocation of the daemon's own code fail, and none of gRPC's. For programs that list
// our_allocations.cpp among their own sources: its operator new then is the program's, and exported names say
// whose an allocation is.
#pragma once

#include <atomic>
#include <limits>

namespace warmfront::test {

/// Counts down to the allocation that fails; below 0: it has failed, or none is to.
extern std::atomic<long> allocations_left;
inline constexpr long kDisarmed = std::numeric_limits<long>::max();
/// Of this thread: the client's, which is in this process.
extern thread_local bool allocations_are_exempt;

}  // namespace warmfront::test
