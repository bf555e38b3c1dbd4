// SPDX-License-Identifier: Apache-2.0
// Runs operations on a collider with an injected fault. For programs that list carry_out.cpp,
// failing_allocations.cpp and counted_looks.cpp among their own sources. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <string>

#include "tests/support/operations.h"

namespace warmfront::testing {

/// The injected fault, at the n-th event, counted from 0.
struct Fault {
  enum class Kind : std::uint8_t {
    kNone,
    kAllocation,      ///< the n-th allocation
    kAllAllocations,  ///< the n-th and all after it
    kCancelled        ///< the n-th look at the flag finds it set
  };
  Kind kind = Kind::kNone;
  long n = 0;
};
std::string to_string(const Fault& fault);

/// Only the call itself is exposed to the fault.
Outcome carry_out(Collider& collider, const Operation& operation, const Fault& fault = {});

}  // namespace warmfront::testing
