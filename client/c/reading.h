// SPDX-License-Identifier: Apache-2.0
// What callers' structs say, in the engine's words. Thread safe; kInvalidArgument names the field at fault.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/c/session.h"
#include "client/c/warmfront.h"
#include "engine/frame.h"
#include "engine/options.h"
#include "engine/question.h"
#include "engine/result.h"
#include "engine/scene.h"

namespace warmfront::c {

/// That `field` is not in [0, last].
Error out_of(const std::string& field, std::int64_t value, int last);

/// A body, which errors call `where`; its first_vertex stays 0. `size`: of the struct, as its caller has it.
Result<Body> body_of(const wf_body* given, const std::string& where, std::size_t& size);

/// So many numbers, of floats or of doubles; refused where the array is null and some are expected.
Result<Positions> positions(const void* first, std::size_t count, bool float32, const std::string& field);

/// `at`: the positions of the scene's vertices.
Result<SceneDescription> scene_of(const wf_scene& from, const Positions& at);
Result<ColliderOptions> options_of(const wf_options& from);

/// A frame's parts, where they are.
struct GivenFrame {
  Frame frame;
  std::vector<BodyPositions> bodies;
  std::vector<BodyPose> poses;
};

/// `into`: the frame given, with views of the caller's arrays; for null nothing is given.
Status take_frame(const wf_session& session, const wf_frame* given, GivenFrame& into);

Result<Question> question_of(QuestionKind kind, const wf_question& from);

}  // namespace warmfront::c
