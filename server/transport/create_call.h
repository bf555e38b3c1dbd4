// SPDX-License-Identifier: Apache-2.0
// One CreateSession call: the upload, then the building of the session on the runner. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <optional>

#include "server/admin/lifecycle.h"
#include "server/session/store.h"
#include "server/transport/context.h"
#include "server/transport/upload.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

class CreateCall final : public grpc::ServerReadReactor<v1::CreateSessionRequest> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it, `response` lives as long as it does.
  static CreateCall* start(Context& context, const grpc::CallbackServerContext& call,
                           v1::CreateSessionResponse& response);

  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  CreateCall(Context& context, const grpc::CallbackServerContext& call, v1::CreateSessionResponse& response);

  std::optional<Fault> add();
  /// Ends the call. The place in the store is given back first: the client may try again as soon as it hears
  /// of it.
  void fail(const grpc::Status& status);
  void build();

  // Constant after construction.
  Context& context_;
  const grpc::CallbackServerContext& call_;
  v1::CreateSessionResponse& response_;
  std::optional<Lifecycle::Call> in_flight_;

  // Used by the one outstanding read, then by build(): never by both at once. After Finish() nothing touches
  // them.
  v1::CreateSessionRequest incoming_;
  Upload upload_;
  std::optional<Store::Reservation> reservation_;
};

}  // namespace warmfront::server
