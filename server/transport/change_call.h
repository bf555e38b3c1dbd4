// SPDX-License-Identifier: Apache-2.0
// One StreamChangeScene call: a request in pieces, carried out as one by its session. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <optional>

#include "server/annotations.h"
#include "server/session/account.h"
#include "server/session/session.h"
#include "server/transport/context.h"
#include "server/transport/upload_call.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

class ChangeCall final : public UploadCall<v1::ChangeSceneRequest> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it, `response` lives as long as it does.
  static ChangeCall* start(Context& context, const grpc::CallbackServerContext& call,
                           grpc::ByteBuffer& response);

 private:
  class Reply;

  ChangeCall(Context& context, const grpc::CallbackServerContext& call, grpc::ByteBuffer& response)
      : UploadCall("StreamChangeScene", context, call, response) {}

  std::optional<Fault> add(v1::ChangeSceneRequest message) override WARMFRONT_REQUIRES(mutex_);
  std::optional<Fault> carry_out() override WARMFRONT_REQUIRES(mutex_);
  void give_back() override;

  std::optional<Fault> begin(v1::ChangeSceneRequest&& first);
  /// Takes its turn on the runner: gives the request to the session.
  void hand_over();
  void answer_with(const Outcome<SessionState>& outcome) noexcept;

  // Protected by mutex_ until it is handed over, then used by that alone.
  std::shared_ptr<Session> session_;  // null before the first message
  v1::ChangeSceneRequest request_;    // as far as it has come
  Holding memory_;                    // of the request
};

}  // namespace warmfront::server
