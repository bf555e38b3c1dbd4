// SPDX-License-Identifier: Apache-2.0
// Changes that come in pieces. Thread safety as stated in the header.
#include "server/transport/change_call.h"

#include <string>
#include <utility>

#include "proto/byte_buffer.h"
#include "proto/wire/scene_change_pieces.h"
#include "server/session/step_cost.h"
#include "server/transport/convert.h"
#include "server/transport/reaction.h"
#include "server/transport/session_metadata.h"
#include "server/transport/session_recording.h"

namespace warmfront::server {

/// The call lives until it is answered.
class ChangeCall::Reply final : public ChangeObserver {
 public:
  Reply(std::shared_ptr<ChangeCall> call, ChangeRecord record)
      : call_(std::move(call)), record_(std::move(record)) {}

  void begins() override { record_.begins(); }
  void answered(const Outcome<SessionState>& outcome) noexcept override {
    record_.answered(outcome);
    call_->answer_with(outcome);
  }

 private:
  const std::shared_ptr<ChangeCall> call_;
  ChangeRecord record_;
};

ChangeCall* ChangeCall::start(Context& context, const grpc::CallbackServerContext& call,
                              grpc::ByteBuffer& response) {
  const std::shared_ptr<ChangeCall> change(new ChangeCall(context, call, response));
  UploadCall::start(change);
  return change.get();
}

std::optional<Fault> ChangeCall::begin(v1::ChangeSceneRequest&& first) {
  Outcome<SessionId> id = session_id_of(first.session_id(), session_metadata(call_));
  if (!id) return id.fault();
  Outcome<std::shared_ptr<Session>> session = context_.store.find(id.value(), principal_.name);
  if (!session) return session.fault();
  session_ = std::move(session).value();
  memory_ = Holding(session_->account());
  request_.set_session_id(first.session_id());
  request_.set_next_frame(first.next_frame());
  request_.set_key(first.key());
  if (first.has_expected_state()) *request_.mutable_expected_state() = first.expected_state();
  if (first.has_options()) *request_.mutable_options() = first.options();
  return std::nullopt;
}

std::optional<Fault> ChangeCall::add(v1::ChangeSceneRequest message) {
  const auto invalid = [](std::string what) {
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput, std::move(what)};
  };
  if (session_) {
    if (!message.session_id().empty() || !message.key().empty() || message.next_frame() != 0 ||
        message.has_expected_state() || message.has_options())
      return invalid("StreamChangeScene: a message after the first has more in it than changes");
    session_->touch();
  }
  const std::size_t bytes = message.SpaceUsedLong();
  if (!session_) {
    if (std::optional<Fault> fault = begin(std::move(message))) return fault;
  }
  if (std::optional<Fault> refusal = session_->account()->refusal(bytes)) return refusal;
  memory_.set(memory_.bytes() + bytes);
  for (v1::SceneChange& change : *message.mutable_changes()) {
    if (!change.continues()) {
      *request_.add_changes() = std::move(change);
      continue;
    }
    const std::string where = "changes[" + std::to_string(request_.changes_size() - 1) + "]";
    if (request_.changes().empty()) return invalid("changes[0].continues: there is no change before it");
    if (Status taken = wire::append_piece(*request_.mutable_changes()->rbegin(), std::move(change), where);
        !taken)
      return fault_from(taken.error());
  }
  return std::nullopt;
}

std::optional<Fault> ChangeCall::carry_out() {
  if (!session_)
    return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
                 "StreamChangeScene: ended without a message; send the request"};
  // The call may be over, and gone, before its turn comes.
  context_.runner.post([call = self<ChangeCall>()] { call->hand_over(); }, Lane::kLong,
                       std::shared_ptr<Share>(tenant_, &tenant_->share));
  state_ = State::kQueued;
  return std::nullopt;
}

void ChangeCall::give_back() {
  request_ = {};
  memory_.set(0);
}

void ChangeCall::hand_over() {
  {
    const MutexLock lock(mutex_);
    if (state_ != State::kQueued) return;  // its client has gone
    state_ = State::kBegun;
  }
  react(
      [&] {
        Outcome<ChangeOrder> order =
            change_order_from(request_, session_->dtype(), context_.limits, session_->account());
        if (!order) {
          give_back();
          return finish_call(*this, refused(order.fault()));
        }
        order.value().given_up = given_up_;
        auto reply = std::make_unique<Reply>(
            self<ChangeCall>(), ChangeRecord(recording_of(*session_), request_, session_->account()));
        give_back();
        session_->change(std::move(order).value(), std::move(reply));
      },
      [&](grpc::Status status) {
        give_back();
        finish_call(*this, std::move(status));
      });
}

void ChangeCall::answer_with(const Outcome<SessionState>& outcome) noexcept {
  answer(*this, [&] {
    if (!outcome) {
      const MutexLock lock(mutex_);
      const bool by_daemon = outcome.fault().code == ErrorCode::kCancelled && given_up_by_daemon_;
      return refused(by_daemon ? *given_up_by_daemon_ : outcome.fault());
    }
    v1::ChangeSceneResponse reply;
    *reply.mutable_session() = to_proto(*session_);
    *reply.mutable_state() = to_proto(outcome.value());
    response_ = serialize(reply);
    return grpc::Status::OK;
  });
}

}  // namespace warmfront::server
