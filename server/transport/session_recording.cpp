// SPDX-License-Identifier: Apache-2.0
// Messages to records. Thread safety as stated in the header.
#include "server/transport/session_recording.h"

#include <new>
#include <utility>

#include "engine/contact_hash.h"
#include "server/transport/errors.h"
#include "server/transport/reaction.h"

namespace warmfront::server {
namespace {

void set_outcome(v1::RecordedOutcome& outcome, const Fault& fault) {
  outcome.set_code(to_grpc_code(fault.code));
  outcome.set_message(fault.message);
}

std::uint64_t hash_of(const Answer& answer) {
  ContactHash hash;
  hash.begin_step(answer.rows());
  for (std::size_t i = 0; i < answer.rows(); ++i)
    hash.add(static_cast<ContactKind>(answer.kind[i]), static_cast<ContactStatus>(answer.status[i]),
             answer.vertices[i], answer.toi[i]);
  return hash.value();
}

}  // namespace

SessionRecording::~SessionRecording() {
  if (!kept_) writer_->discard();
}

template <class Fill>
void SessionRecording::write(Fill fill) {
  try {
    v1::RecordedMessage message;
    fill(message);
    writer_->write(std::move(message));
  } catch (const std::bad_alloc&) {
    if_memory_allows([&] { writer_->stop("out of memory"); });
  }
}

void SessionRecording::upload(const v1::CreateSessionRequest& part) {
  write([&](v1::RecordedMessage& message) { *message.mutable_create() = part; });
}

void SessionRecording::frame(std::vector<v1::StepFrame> parts) {
  for (v1::StepFrame& part : parts)
    write([&](v1::RecordedMessage& message) { *message.mutable_step() = std::move(part); });
}

void SessionRecording::answer(std::uint64_t frame, const Outcome<std::shared_ptr<const Answer>>& outcome) {
  write([&](v1::RecordedMessage& message) {
    v1::RecordedAnswer& to = *message.mutable_answer();
    to.set_frame(frame);
    to.mutable_outcome();
    if (!outcome) return set_outcome(*to.mutable_outcome(), outcome.fault());
    const Answer& answer = *outcome.value();
    to.set_vf(answer.vf);
    to.set_ee(answer.ee);
    to.set_possible(answer.possible);
    if (answer.earliest_toi) to.set_earliest_toi(*answer.earliest_toi);
    to.set_contacts_hash(hash_of(answer));
  });
}

void SessionRecording::change(const v1::ChangeSceneRequest& request) {
  write([&](v1::RecordedMessage& message) { *message.mutable_change() = request; });
}

void SessionRecording::changed(const Outcome<SessionState>& outcome) {
  write([&](v1::RecordedMessage& message) {
    v1::RecordedOutcome& changed = *message.mutable_changed();
    if (!outcome) set_outcome(changed, outcome.fault());
  });
}

Hooks<Session::StepDone> recorded(const std::shared_ptr<SessionRecording>& recording, std::uint64_t frame,
                                  std::vector<v1::StepFrame> parts, Session::StepDone done) {
  if (!recording) return {{}, std::move(done)};
  // Shared by both hooks, which the session calls one after the other.
  struct Call {
    std::vector<v1::StepFrame> parts;
    bool begun = false;
  };
  auto call = std::make_shared<Call>(Call{std::move(parts)});
  return {[recording, call] {
            call->begun = true;
            recording->frame(std::move(call->parts));
          },
          [recording, call, frame, done = std::move(done)](Outcome<std::shared_ptr<const Answer>> outcome) {
            if (call->begun) if_memory_allows([&] { recording->answer(frame, outcome); });
            done(std::move(outcome));
          }};
}

Hooks<Session::ChangeDone> recorded(const std::shared_ptr<SessionRecording>& recording,
                                    const v1::ChangeSceneRequest& request, Session::ChangeDone done) {
  if (!recording) return {{}, std::move(done)};
  auto begun = std::make_shared<bool>(false);
  return {[recording, begun, request] {
            *begun = true;
            // Meant for the states of the session that was recorded, not of one that replays it.
            v1::ChangeSceneRequest meant_for_any = request;
            meant_for_any.clear_expected_state();
            meant_for_any.clear_key();
            recording->change(meant_for_any);
          },
          [recording, begun, done = std::move(done)](const Outcome<SessionState>& outcome) {
            if (*begun) if_memory_allows([&] { recording->changed(outcome); });
            done(outcome);
          }};
}

}  // namespace warmfront::server
