// SPDX-License-Identifier: Apache-2.0
// A recording as an input: its scene, and where everything was frame by frame. One thread at a time.
#pragma once

#include <memory>
#include <string>

#include "client/io/input.h"
#include "engine/options.h"

namespace warmfront::client {

bool is_recording_name(const std::string& name);

struct RecordedScene {
  std::unique_ptr<Input> input;
  ColliderOptions options;  ///< of the recorded session
};

/// Reads the whole recording: its upload and the frames that were answered, each with all positions. Frames
/// that were sent in parts are put together. kInvalidArgument for what is no recording, for one without an
/// answered frame, and for what whole positions cannot say: a scene that changes, and poses in a session of
/// float32.
Result<RecordedScene> open_recorded_scene(const std::string& path);

}  // namespace warmfront::client
