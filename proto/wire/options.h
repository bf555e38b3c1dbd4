// SPDX-License-Identifier: Apache-2.0
// A collider's options on the wire. Thread-safe.
#pragma once

#include "engine/options.h"
#include "engine/result.h"
#include "warmfront/v1/options.pb.h"

namespace warmfront::wire {

/// Every field set.
v1::ColliderOptions to_proto(const ColliderOptions& options);
/// What is left out gets its default. kInvalidArgument, naming the field, for an enum's value that this build
/// does not know; ranges are not looked at (see validate()).
Result<ColliderOptions> options_from(const v1::ColliderOptions& message);

}  // namespace warmfront::wire
