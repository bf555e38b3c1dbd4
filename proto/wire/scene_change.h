// SPDX-License-Identifier: Apache-2.0
// A change of the scene on the wire. Thread-safe.
#pragma once

#include <string>

#include "engine/result.h"
#include "engine/scene.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::wire {

/// Positions of a session of float32 are float32, else float64. kInvalidArgument, with a message that begins
/// with `where`, for a change of a kind unknown to this build, fields of a length that does not fit, and what
/// body_from() and filters_from() refuse. What the scene says of it is for the engine.
Result<SceneChange> change_from(const v1::SceneChange& message, bool float32, const std::string& where);

}  // namespace warmfront::wire
