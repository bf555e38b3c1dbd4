// SPDX-License-Identifier: Apache-2.0
// What is asked of a frame, on the wire. Thread-safe.
#pragma once

#include "engine/question.h"
#include "engine/result.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::wire {

/// The fields of what the question states; its kind always.
v1::Question to_proto(const Question& question);
/// kInvalidArgument, naming the field, for an enum's value that this build does not know, and for fields that
/// contradict the kind; ranges are not looked at (see validate()).
Result<Question> question_from(const v1::Question& message);

}  // namespace warmfront::wire
