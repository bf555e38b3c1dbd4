// SPDX-License-Identifier: Apache-2.0
// The wire's messages as the engine's values and back. Thread-safe.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "proto/wire/enums.h"
#include "proto/wire/filters.h"
#include "proto/wire/options.h"
#include "proto/wire/question.h"
#include "proto/wire/scene.h"
#include "proto/wire/scene_change.h"
#include "proto/wire/statistics.h"
#include "server/session/answer.h"
#include "server/session/limits.h"
#include "server/session/session.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

using wire::to_proto;

/// INVALID_ARGUMENT for a value that this build does not know; what is left out gets its default. Capacities
/// are lowered to the daemon's limits. Ranges are checked here too, so that a bad value is refused before a
/// mesh is uploaded.
Outcome<ColliderOptions> options_from(const v1::ColliderOptions& message, const Limits& limits);

/// INVALID_ARGUMENT for DTYPE_UNSPECIFIED and for values unknown.
Outcome<Dtype> dtype_from(v1::Dtype dtype);

/// INVALID_ARGUMENT for a client_id without an attempt, the other way round, or too long a one.
Outcome<Session::Claim> claim_from(const v1::Attach& message);

/// The spec with no faces yet. INVALID_ARGUMENT for a bad field, RESOURCE_EXHAUSTED for a scene beyond the
/// limits.
Outcome<SessionSpec> spec_from(const v1::SessionHeader& header, const Limits& limits);

/// What a request asks for. INVALID_ARGUMENT as above; limits on the scene are for the session to look at, in
/// its turn. What the changes take until then is charged to `account`, which may be null, before they are
/// made: RESOURCE_EXHAUSTED where that refuses it.
Outcome<ChangeOrder> change_order_from(const v1::ChangeSceneRequest& request, Dtype dtype,
                                       const Limits& limits, std::shared_ptr<Account> account);

/// What a message of a frame (v1::StepFrame or v1::StepRequest) asks: a step where it says nothing.
/// INVALID_ARGUMENT, in words that begin with the frame, as wire::question_from().
template <class Message>
Outcome<Question> question_from(const Message& message) {
  if (!message.has_question()) return Question();
  Result<Question> question = wire::question_from(message.question());
  if (!question) return fault_from(question.error(), "frame " + std::to_string(message.frame()) + ": ");
  return std::move(question).value();
}

/// Of a message whose question is refused: its kind alone, where that can be told.
template <class Message>
Question refused_question(const Message& message) {
  Question question;
  static_cast<void>(wire::read(message.question().kind(), "question.kind", question.kind));
  return question;
}

/// Appends a message of a frame (v1::StepFrame or v1::StepRequest). What is too much is kept in the buffer as
/// an error, for the session to answer by its rules.
template <class Message>
void append(const Message& message, FrameBuffer& contents) {
  static_cast<void>(contents.append(message.positions()));
  if (!message.has_moved()) return;
  const v1::MovedParts& moved = message.moved();
  static_cast<void>(contents.append(MovedPiece{moved.bodies(), moved.body_positions(), moved.pose_bodies(),
                                               moved.poses(), moved.vertices(), moved.vertex_positions()}));
}

v1::MovedParts to_proto(const MovedPiece& piece);
v1::SessionInfo to_proto(const Session& session);
v1::SessionState to_proto(const SessionState& state);
/// As they are for a principal.
v1::Limits to_proto(const Limits& limits, const Quota& quota);
v1::StepSummary summary_of(const Answer& answer);

/// Rows [first, first + count) of the answer.
void fill_columns(const Answer& answer, std::size_t first, std::size_t count, v1::ContactColumns& columns);
/// `count` distances of vertices from `first` on.
void fill_distances(const Answer& answer, std::size_t first, std::size_t count, std::string& bytes);
/// `count` worlds from `first` on, and their times.
void fill_worlds(const Answer& answer, std::size_t first, std::size_t count, std::string& worlds,
                 std::string& tois);

}  // namespace warmfront::server
