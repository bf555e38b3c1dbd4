// SPDX-License-Identifier: Apache-2.0
// One unary Step call. Thread-safe.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "server/process/lifecycle.h"
#include "server/session/session.h"
#include "server/transport/context.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// When its client gives up or its deadline passes, a frame that waits or is being computed is left undone.
class StepCall final : public grpc::ServerUnaryReactor {
 public:
  struct Request {
    ParseRoom::Place place;
    std::shared_ptr<Session> session;
    v1::StepRequest message;
    std::optional<TraceContext> caller_trace;
  };

  /// Lives until gRPC calls OnDone(). `context` outlives it, `response` lives as long as the call, and so
  /// does what `receive` uses. That returns the request: at once, or, where it is heavy, in the turn of
  /// `tenant`, who else is null.
  static StepCall* start(Context& context, std::shared_ptr<Tenant> tenant,
                         std::function<Outcome<Request>()> receive, grpc::ByteBuffer& response);

  void OnCancel() override { given_up_->store(true, std::memory_order_relaxed); }
  void OnDone() override { delete this; }

 private:
  class Reply;

  explicit StepCall(Context& context, grpc::ByteBuffer& response) : context_(context), response_(response) {}

  void step(const Outcome<Request>& request);
  void step(const Request& request);
  void respond(const Answer& answer);

  // Constant after construction.
  Context& context_;
  grpc::ByteBuffer& response_;
  const std::shared_ptr<std::atomic<bool>> given_up_ = std::make_shared<std::atomic<bool>>(false);

  // Used by step(), and given back when the call is done.
  std::optional<Lifecycle::Call> in_flight_;

  // Used by whoever answers: the response, on the session's account.
  Holding response_bytes_;
};

}  // namespace warmfront::server
