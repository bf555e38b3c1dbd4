// SPDX-License-Identifier: Apache-2.0
// Bodies on the wire. Thread-safe.
#pragma once

#include <string>

#include "engine/result.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

/// Every field set.
v1::Body to_proto(const Body& body);
/// Omitted fields get their default. kInvalidArgument, with a message that begins with `where`, for a kind
/// unknown to this build, or a name that is too long.
Result<Body> body_from(const v1::Body& message, const std::string& where);

}  // namespace warmfront::wire
