// SPDX-License-Identifier: Apache-2.0
// The engine's error codes and the canonical ones of gRPC (google.rpc.Code). Pure functions.
#pragma once

#include "engine/result.h"

namespace warmfront::wire {

/// In [1, 16].
int canonical_code(ErrorCode code);
/// OUT_OF_RANGE becomes kInvalidArgument; UNKNOWN and invalid codes become kInternal.
ErrorCode error_code(int canonical);
/// As gRPC spells it: "RESOURCE_EXHAUSTED"; "UNKNOWN" for what is no code.
const char* canonical_name(int canonical);

}  // namespace warmfront::wire
