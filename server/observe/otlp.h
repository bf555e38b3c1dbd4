// SPDX-License-Identifier: Apache-2.0
// Traces as OTLP's JSON (opentelemetry-proto, ExportTraceServiceRequest). A pure function.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "server/observe/frame_trace.h"

namespace warmfront::server {

/// One request, on one line: a span for each frame (kind SERVER, below the caller's), and below that
/// `receive`, `queue`, `step`, `encode` and `send` one after the other; below `step` a span a stage, in the
/// order of the stages and as long as each took. `instance` tells this daemon from others. A failed frame has
/// its error's message and no stages.
std::string otlp_json(std::span<const FrameTrace> frames, std::string_view instance);

}  // namespace warmfront::server
