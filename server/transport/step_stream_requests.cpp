// SPDX-License-Identifier: Apache-2.0
// What a stream's messages ask for: a session is attached, frames are put together and submitted, commits are
// submitted. Thread safety as stated in step_stream.h.
#include <string_view>
#include <utility>

#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/frame_outcome.h"
#include "server/transport/session_metadata.h"
#include "server/transport/step_stream.h"

namespace warmfront::server {

void StepStream::handle(StreamRequest& request, Way way) {
  switch (request.message.message_case()) {
    case v1::StreamStepsRequest::kAttach:
      return attach(request.message.attach());
    case v1::StreamStepsRequest::kStep:
      return take(request, way);
    case v1::StreamStepsRequest::kCommit:
      return commit(request.message.commit());
    case v1::StreamStepsRequest::kDetach:
      return half_closed();
    case v1::StreamStepsRequest::kSharedMemory:
      if (way == Way::kStream)
        return end(out_of_place("shared_memory: is asked for on the socket beside; send it there"));
      return give_memory(request.message.shared_memory());
    case v1::StreamStepsRequest::kOnStream: {
      if (way == Way::kStream)
        return end(out_of_place(
            "on_stream: is of the socket beside; leave it out, as here all comes on the stream"));
      const MutexLock lock(mutex_);
      on_stream_ = true;
      return;
    }
    case v1::StreamStepsRequest::MESSAGE_NOT_SET:
      return;  // refused when it was parsed
  }
}

void StepStream::half_closed() {
  if (assembly_)
    end({ErrorCode::kInvalidArgument, Reason::kInvalidInput,
         frame_name(assembly_->number()) + ": the stream ended before its last positions"});
  const MutexLock lock(mutex_);
  end_locked(grpc::Status::OK);
}

void StepStream::attach(const v1::Attach& request) {
  {
    const MutexLock lock(mutex_);
    if (state_.attach != StreamAttach::kNone)
      return end_locked(
          context_.refuse(out_of_place("a second attach; open another stream for another session")));
  }
  Outcome<SessionId> id = session_id_of(request.session_id(), metadata_id_);
  if (!id) return end(id.fault());
  Outcome<Session::Claim> claim = claim_from(request);
  if (!claim) return end(claim.fault());
  Outcome<std::shared_ptr<Session>> session = context_.store.find(id.value(), principal_.name);
  if (!session) return end(session.fault());
  {
    const MutexLock lock(mutex_);
    session_ = session.value();
    current_bytes_ = Holding(session_->account());
    happened_locked(StreamEvent::Kind::kAttachStarted);
  }
  // Weak, because a stream ends whenever its client likes, and neither session nor frames should keep it.
  const std::weak_ptr<StepStream> weak = weak_from_this();
  Outcome<Session::Attachment> attachment = session.value()->attach(
      std::move(claim.value()),
      [weak](const Fault& fault) {
        if (const auto stream = weak.lock()) stream->end(fault);
      },
      [weak](const Outcome<Standing>& standing) {
        if (const auto stream = weak.lock()) stream->attached(standing);
      });
  const MutexLock lock(mutex_);
  if (attachment) {
    attachment_ = attachment.value();
  } else {
    happened_locked(StreamEvent::Kind::kAttachSettled);
    end_locked(context_.refuse(attachment.fault(), tenant_.get()));
  }
}

StepStream::Held StepStream::held() {
  const MutexLock lock(mutex_);
  return {session_, attachment_};
}

void StepStream::take(StreamRequest& request, Way way) {
  const v1::StepFrame& part = request.message.step();
  const Held held = this->held();
  if (!held.session) return end(out_of_place("a step before attach; name the session first"));
  const bool first = !assembly_;
  if (first) {
    assembly_.emplace(*held.session, tenant_->frames, context_.frames, part.frame());
    assembly_->pass().given_up = given_up_;
    assembly_->pass().attachment = held.attachment;
    assembly_->ask(part);
    assembly_trace_ = trace_of(part.frame());
  } else if (std::optional<Fault> fault = assembly_->refusal_of(part)) {
    return end(*fault);
  }
  std::shared_ptr<StreamMemory> memory;  // until the positions are copied
  Outcome<AnswerRoom> room = take_shared(request, memory);
  if (!room && !assembly_->pass().refused) assembly_->pass().refused = room.fault();
  if (way == Way::kPacket && !part.more()) held.session->expect_step();
  assembly_->add(request);
  {
    const MutexLock lock(mutex_);
    if (part.more() && !state_.awaiting) awaited_since_ = Clock::now();
    happened_locked(part.more() ? StreamEvent::Kind::kPartTaken : StreamEvent::Kind::kFrameTaken);
  }
  if (part.more()) return;
  FrameRecord record(recording_of(*held.session), part.frame(), assembly_->take_parts());
  if (assembly_trace_) assembly_trace_->arrived = Clock::now();
  if (!room) room = AnswerRoom();
  held.session->submit(assembly_->finish(reply_to(part.frame(), std::move(record), std::move(assembly_trace_),
                                                  std::move(room).value())),
                       way == Way::kPacket ? Session::Admission::kHere : Session::Admission::kAlways);
  assembly_.reset();
}

void StepStream::commit(const v1::Commit& request) {
  const Held held = this->held();
  if (!held.session) return end(out_of_place("a commit before attach; name the session first"));
  if (assembly_)
    return end(out_of_place("a commit within " + frame_name(assembly_->number()) +
                            "; mark a frame's last part with more = false"));
  FramePass pass = admit_frame(tenant_->frames, context_.frames, held.session->account(), 0);
  pass.given_up = given_up_;
  pass.attachment = held.attachment;
  {
    const MutexLock lock(mutex_);
    happened_locked(StreamEvent::Kind::kFrameTaken);
  }
  FrameRecord record(recording_of(*held.session), request);
  held.session->submit({request.frame(), FrameCommit{request.fraction()}, std::move(pass),
                        reply_to(request.frame(), std::move(record), trace_of(request.frame()))},
                       Session::Admission::kAlways);
}

// Weak, because a stream ends whenever its client likes, and no frame should keep it.
class StepStream::Reply final : public FrameObserver {
 public:
  Reply(std::weak_ptr<StepStream> stream, std::uint64_t frame, FrameRecord record,
        std::unique_ptr<FrameTrace> trace, AnswerRoom room)
      : stream_(std::move(stream)),
        frame_(frame),
        record_(std::move(record)),
        trace_(std::move(trace)),
        room_(std::move(room)) {}

  void begins() override {
    if (trace_) trace_->begun = Clock::now();
    record_.begins();
  }
  void answered(const FrameOutcome& outcome) noexcept override {
    if (trace_) note_outcome(outcome, *trace_);
    record_.answered(outcome);
    if (const std::shared_ptr<StepStream> stream = stream_.lock())
      stream->answered(frame_, outcome, std::move(room_), std::move(trace_));
  }

 private:
  const std::weak_ptr<StepStream> stream_;
  const std::uint64_t frame_;
  FrameRecord record_;
  std::unique_ptr<FrameTrace> trace_;  // null where it is not traced
  AnswerRoom room_;
};

std::unique_ptr<FrameTrace> StepStream::trace_of(std::uint64_t frame) noexcept {
  if (!context_.tracer) return nullptr;
  const MutexLock lock(mutex_);
  return context_.tracer->begin(caller_trace_, "StreamSteps",
                                session_ ? std::string_view(session_->id().text()) : std::string_view(),
                                frame);
}

std::unique_ptr<FrameObserver> StepStream::reply_to(std::uint64_t frame, FrameRecord record,
                                                    std::unique_ptr<FrameTrace> trace, AnswerRoom room) {
  return std::make_unique<Reply>(weak_from_this(), frame, std::move(record), std::move(trace),
                                 std::move(room));
}

}  // namespace warmfront::server
