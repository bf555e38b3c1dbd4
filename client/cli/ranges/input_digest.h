// SPDX-License-Identifier: Apache-2.0
// Digests that tell whether two runs are of one input and ask one question. Pure functions.
#pragma once

#include <string>
#include <string_view>

#include "engine/frame.h"
#include "engine/options.h"
#include "engine/scene.h"

namespace warmfront::client {

/// 16 lower-case hexadecimal digits of positions, (n, 3), their number type included.
std::string digest_of(const Positions& positions);

/// The same of a scene in its first frame: topology, bodies, filters, thickness and positions; of those
/// options that decide which contacts there are and what is told of each, and of `more`. Not of options that
/// are a matter of speed: runs with different ones give the same contacts.
std::string digest_of(const SceneDescription& scene, const Positions& first, const ColliderOptions& options,
                      std::string_view more);

}  // namespace warmfront::client
