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
  for (std::size_t i = 0; i < answer.rows(); ++i) {
    const auto status = static_cast<ContactStatus>(answer.status[i]);
    if (!answer.edge_faces.empty())
      hash.add_edge_face(status, answer.edge_faces[i], answer.toi[i]);
    else
      hash.add(static_cast<ContactKind>(answer.kind[i]), status, answer.vertices[i], answer.toi[i]);
  }
  hash.add_distances(answer.vertex_distances);
  for (std::size_t i = 0; i < answer.multiplicity.size(); ++i)
    hash.add_closest_pair({answer.multiplicity[i], answer.stencil[i]});
  return hash.value();
}

}  // namespace

void RecordedParts::add(v1::StepFrame part, std::size_t most) {
  if (too_large_) return;
  const std::size_t bytes = memory_.bytes() + part.SpaceUsedLong();
  if (bytes > most) {
    too_large_ = true;
    parts_ = {};
    return memory_.set(0);
  }
  parts_.push_back(std::move(part));
  memory_.set(bytes);
}

SessionRecording::~SessionRecording() {
  disk_->close(file_, kept_);
}

template <class Fill>
void SessionRecording::write(Fill fill) {
  if (file_->stopped()) return;
  try {
    v1::RecordedMessage message;
    fill(message);
    message.set_at_us(static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start_)
            .count()));
    Result<std::string> record = recording::record_of(message);
    if (!record) return disk_->stop(file_, "a record is too large for the format");
    disk_->append(file_, std::move(record).value());
  } catch (const std::bad_alloc&) {
    disk_->stop(file_, "out of memory");
  }
}

void SessionRecording::upload(const v1::CreateSessionRequest& part) {
  write([&](v1::RecordedMessage& message) { *message.mutable_create() = part; });
}

void SessionRecording::frame(RecordedParts parts) {
  if (parts.too_large_)
    return disk_->stop(file_, "a frame came in too many parts, or with more bytes than its scene has");
  for (v1::StepFrame& part : parts.parts_)
    write([&](v1::RecordedMessage& message) { *message.mutable_step() = std::move(part); });
}

void SessionRecording::commit(const v1::Commit& request) {
  write([&](v1::RecordedMessage& message) { *message.mutable_commit() = request; });
}

void SessionRecording::answer(std::uint64_t frame, const FrameOutcome& outcome) {
  write([&](v1::RecordedMessage& message) {
    v1::RecordedAnswer& to = *message.mutable_answer();
    to.set_frame(frame);
    to.mutable_outcome();
    if (!outcome) return set_outcome(*to.mutable_outcome(), outcome.fault());
    const Answer& answer = *outcome.value();
    to.set_vf(answer.vf);
    to.set_ee(answer.ee);
    to.set_vh(answer.vh);
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

void FrameRecord::begins() {
  if (!recording_) return;
  begun_ = true;
  if (auto* parts = std::get_if<RecordedParts>(&sent_))
    recording_->frame(std::move(*parts));
  else
    recording_->commit(std::get<v1::Commit>(sent_));
}

void FrameRecord::answered(const FrameOutcome& outcome) noexcept {
  if (begun_) if_memory_allows([&] { recording_->answer(frame_, outcome); });
}

ChangeRecord::ChangeRecord(std::shared_ptr<SessionRecording> recording, const v1::ChangeSceneRequest& request,
                           std::shared_ptr<Account> account)
    : recording_(std::move(recording)), memory_(std::move(account)) {
  if (!recording_) return;
  request_ = request;
  // Meant for the states of the session that was recorded, not of one that replays it.
  request_.clear_expected_state();
  request_.clear_key();
  memory_.set(request_.SpaceUsedLong());
}

void ChangeRecord::begins() {
  if (!recording_) return;
  begun_ = true;
  recording_->change(std::exchange(request_, {}));
  memory_.set(0);
}

void ChangeRecord::answered(const Outcome<SessionState>& outcome) noexcept {
  if (begun_) if_memory_allows([&] { recording_->changed(outcome); });
}

}  // namespace warmfront::server
