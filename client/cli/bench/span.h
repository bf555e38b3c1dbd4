// SPDX-License-Identifier: Apache-2.0
// `bench --span`: the work and the span of an input's steps, and how much faster they would be on more cores
// than there are. Used by the main thread only.
#pragma once

#include <string>

#include "client/cli/frames/frame_steps.h"
#include "client/io/input.h"
#include "engine/options.h"
#include "engine/result.h"

namespace warmfront::client {

/// Steps through the range on one thread, recording what each step forks into, and on as many threads as the
/// machine has cores. The text of a table: of creating the collider with its scene, of the first step and of the others, work and span in
/// milliseconds, the predicted speed-up on 1, 2, 4, ... 128 cores, the measured one, and the longest pieces
/// of the longest chain. Fails as reading and stepping do.
Result<std::string> measure_span(Input& input, FrameRange range, std::uint32_t substeps,
                                 const ColliderOptions& options);

}  // namespace warmfront::client
