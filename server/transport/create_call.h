// SPDX-License-Identifier: Apache-2.0
// One CreateSession call: the upload, then the building of the session on the runner. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <optional>

#include "server/annotations.h"
#include "server/session/account.h"
#include "server/session/store.h"
#include "server/transport/context.h"
#include "server/transport/session_recording.h"
#include "server/transport/upload.h"
#include "server/transport/upload_call.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

class CreateCall final : public UploadCall<v1::CreateSessionRequest> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it, `response` lives as long as it does.
  static CreateCall* start(Context& context, const grpc::CallbackServerContext& call,
                           grpc::ByteBuffer& response);

 private:
  CreateCall(Context& context, const grpc::CallbackServerContext& call, grpc::ByteBuffer& response);

  std::optional<Fault> add(v1::CreateSessionRequest message) override WARMFRONT_REQUIRES(mutex_);
  std::optional<Fault> carry_out() override WARMFRONT_REQUIRES(mutex_);
  void give_back() override;
  void log_refused(const Fault& fault) const override;
  /// A session that its client will not hear of is not kept.
  void done() override;

  std::optional<Fault> reserve();
  /// Takes its turn on the runner.
  void build(Lane lane);
  /// The session and the response that tells of it; nothing is to be seen of either yet.
  Outcome<std::shared_ptr<Session>> make(Lane lane);
  void log_created(const Session& session) const;
  /// The call was cancelled after its session was made, and nobody has used that.
  void drop_orphan();

  // Protected by mutex_ until it is being built, then used by build() and OnDone() only.
  std::optional<Upload> upload_;
  std::shared_ptr<Account> account_;
  std::optional<Store::Reservation> reservation_;
  std::shared_ptr<SessionRecording> recording_;
  std::shared_ptr<Session> made_;
};

}  // namespace warmfront::server
