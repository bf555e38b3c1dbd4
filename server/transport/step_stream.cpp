// SPDX-License-Identifier: Apache-2.0
// The hot path: messages in, frames to the session, answers out. Thread safety as stated in the header.
#include "server/transport/step_stream.h"

#include <new>
#include <utility>
#include <vector>

#include "server/transport/convert.h"
#include "server/transport/errors.h"
#include "server/transport/session_metadata.h"
#include "server/transport/stream_codec.h"

namespace warmfront::server {
namespace {

Fault out_of_place(std::string message) {
  return {ErrorCode::kFailedPrecondition, Reason::kProtocol, "StreamSteps: " + std::move(message)};
}

}  // namespace

StepStream* StepStream::start(Context& context, const grpc::CallbackServerContext& call) {
  std::shared_ptr<StepStream> stream(new StepStream(context, session_metadata(call)));
  stream->self_ = stream;
  Outcome<Lifecycle::Call> begun = context.lifecycle.begin(stream);
  const std::lock_guard lock(stream->mutex_);
  if (begun)
    stream->call_.emplace(std::move(begun).value());
  else
    stream->end_locked(to_grpc(begun.fault()));
  stream->advance_locked();
  return stream.get();
}

void StepStream::OnReadDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    reading_ = false;
    handling_ = true;
    last_moved_ = std::chrono::steady_clock::now();
  }
  if (!ok) {
    half_closed();
  } else if (Outcome<v1::StreamStepsRequest> request = parse_request(incoming_); request) {
    handle(std::move(request).value());
  } else {
    end(request.fault());
  }
  const std::lock_guard lock(mutex_);
  handling_ = false;
  advance_locked();
}

void StepStream::half_closed() {
  if (assembly_)
    end({ErrorCode::kInvalidArgument, Reason::kInvalidInput,
         "frame " + std::to_string(assembly_->frame) + ": the stream ended before its last positions"});
  const std::lock_guard lock(mutex_);
  end_locked(grpc::Status::OK);
}

void StepStream::handle(v1::StreamStepsRequest request) {
  switch (request.message_case()) {
    case v1::StreamStepsRequest::kAttach:
      return attach(request.attach());
    case v1::StreamStepsRequest::kStep:
      return take(std::move(*request.mutable_step()));
    case v1::StreamStepsRequest::kDetach:
      return half_closed();
    case v1::StreamStepsRequest::MESSAGE_NOT_SET:
      return;  // refused when it was parsed
  }
}

void StepStream::attach(const v1::Attach& request) {
  {
    const std::lock_guard lock(mutex_);
    if (session_)
      return end_locked(to_grpc(out_of_place("a second attach; open another stream for another session")));
  }
  Outcome<SessionId> id = session_id_of(request.session_id(), metadata_id_);
  if (!id) return end(id.fault());
  Outcome<std::shared_ptr<Session>> session = context_.store.find(id.value());
  if (!session) return end(session.fault());
  {
    const std::lock_guard lock(mutex_);
    session_ = session.value();
    attaching_ = true;
  }
  // Weak, because a stream ends whenever its client likes, and neither session nor frames should keep it.
  const std::weak_ptr<StepStream> weak = weak_from_this();
  Outcome<Session::Attachment> attachment = session.value()->attach(
      request.takeover(),
      [weak](const Fault& fault) {
        if (const auto stream = weak.lock()) stream->end(fault);
      },
      [weak](const Outcome<std::uint64_t>& expected_frame) {
        if (const auto stream = weak.lock()) stream->attached(expected_frame);
      });
  const std::lock_guard lock(mutex_);
  if (attachment) {
    attachment_ = attachment.value();
    if (finished_) release_locked();  // the client left meanwhile
  } else {
    attaching_ = false;
    end_locked(to_grpc(attachment.fault()));
  }
}

void StepStream::take(v1::StepFrame part) {
  std::shared_ptr<Session> session;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
  }
  if (!session) return end(out_of_place("a step before attach; name the session first"));
  if (!assembly_)
    assembly_.emplace(
        Assembly{part.frame(), PositionBuffer(session->dtype(), session->scene().vertex_count())});
  if (assembly_->frame != part.frame())
    return end(out_of_place("frame " + std::to_string(part.frame()) + " begins within frame " +
                            std::to_string(assembly_->frame) +
                            "; mark a frame's last part with more = false"));
  // An overflow is kept in the buffer and answered in the frame's turn, so that answers keep their order.
  static_cast<void>(assembly_->positions.append(part.positions()));
  if (part.more()) return;

  {
    const std::lock_guard lock(mutex_);
    ++in_flight_;
  }
  const std::uint64_t frame = part.frame();
  session->step(frame, std::move(assembly_->positions), Session::Admission::kAlways,
                [weak = weak_from_this(), frame](const Outcome<std::shared_ptr<const Answer>>& outcome) {
                  if (const auto stream = weak.lock()) stream->answered(frame, outcome);
                });
  assembly_.reset();
}

void StepStream::attached(const Outcome<std::uint64_t>& expected_frame) {
  const std::lock_guard lock(mutex_);
  attaching_ = false;
  if (expected_frame) {
    v1::StreamStepsResponse response;
    response.mutable_attached()->set_expected_frame(expected_frame.value());
    *response.mutable_attached()->mutable_limits() = to_proto(context_.limits);
    writes_.push_back({serialize(response), false});
  } else {
    end_locked(to_grpc(expected_frame.fault()));
  }
  advance_locked();
}

void StepStream::answered(std::uint64_t frame, const Outcome<std::shared_ptr<const Answer>>& outcome) {
  // Encoded on this, a runner's, thread: reactions stay short.
  std::vector<grpc::ByteBuffer> messages;
  try {
    if (outcome)
      messages = encode_answer(*outcome.value(), context_.limits.answer_chunk_bytes);
    else
      messages.push_back(encode_error(frame, outcome.fault()));
  } catch (const std::bad_alloc&) {
    messages.clear();
    messages.push_back(encode_error(
        frame,
        {ErrorCode::kResourceExhausted, Reason::kLimit,
         "frame " + std::to_string(frame) + ": no memory to send its answer; send the frame again for it"}));
  }
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < messages.size(); ++i)
    writes_.push_back({std::move(messages[i]), i + 1 == messages.size()});
  if (!outcome && outcome.fault().session_lost()) end_locked(to_grpc(outcome.fault()));
  advance_locked();
}

void StepStream::notify_draining(std::chrono::system_clock::time_point deadline) {
  v1::StreamStepsResponse response;
  response.mutable_draining()->set_deadline_unix_ms(
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline.time_since_epoch()).count());
  const std::lock_guard lock(mutex_);
  writes_.push_back({serialize(response), false});
  advance_locked();
}

void StepStream::end(const Fault& fault) {
  const std::lock_guard lock(mutex_);
  end_locked(to_grpc(fault));
  advance_locked();
}

void StepStream::end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) {
  const std::lock_guard lock(mutex_);
  // With frames in hand, more may wait unread behind them.
  if (in_flight_ > 0 || attaching_ || std::chrono::steady_clock::now() - last_moved_ < quiet) return;
  end_locked(to_grpc(fault));
  advance_locked();
}

void StepStream::end_locked(grpc::Status status) {
  if (!end_) end_ = std::move(status);
}

void StepStream::release_locked() {
  if (attachment_) session_->detach(*std::exchange(attachment_, std::nullopt));
}

void StepStream::advance_locked() {
  if (finished_) return;
  if (broken_) {
    writes_.clear();
  } else if (!writing_ && !writes_.empty()) {
    current_ = std::move(writes_.front());
    writes_.pop_front();
    writing_ = true;
    StartWrite(&current_.message);
  }
  const bool delivered = broken_ || (in_flight_ == 0 && !attaching_ && !handling_);
  if ((end_ || broken_) && !writing_ && delivered) {
    finished_ = true;
    // First, so that a client that has seen its stream end finds the session free for the next one.
    release_locked();
    Finish(end_.value_or(grpc::Status::CANCELLED));
  } else if (!end_ && !broken_ && !reading_ && !handling_ && !attaching_ &&
             in_flight_ < context_.limits.window) {
    reading_ = true;
    StartRead(&incoming_);
  }
}

void StepStream::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  last_moved_ = std::chrono::steady_clock::now();
  if (current_.ends_frame) --in_flight_;
  current_ = {};
  if (!ok) broken_ = true;
  advance_locked();
}

void StepStream::OnCancel() {
  const std::lock_guard lock(mutex_);
  broken_ = true;
  advance_locked();
}

void StepStream::OnDone() {
  std::shared_ptr<StepStream> self = std::move(self_);
  // The call counts as in flight until the stream is gone; the memory goes last.
  const std::optional<Lifecycle::Call> call = std::move(call_);
  self.reset();
}

}  // namespace warmfront::server
