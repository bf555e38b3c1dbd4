// SPDX-License-Identifier: Apache-2.0
// A recording as an input: its scene, and all positions frame by frame. One thread at a time.
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

/// Reads the whole recording: its upload and the answered frames, each with all positions. Frames sent in
/// parts are joined. A note says so where the recording is incomplete. kInvalidArgument for an invalid
/// recording, one without an answered frame, and one that whole positions cannot represent: a scene that
/// changes, or poses in a float32 session.
Result<RecordedScene> open_recorded_scene(const std::string& path);

}  // namespace warmfront::client
