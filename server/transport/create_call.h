// SPDX-License-Identifier: Apache-2.0
// One CreateSession call: the upload, then the building of the session on the runner. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>

#include "server/annotations.h"
#include "server/process/lifecycle.h"
#include "server/session/account.h"
#include "server/session/store.h"
#include "server/transport/context.h"
#include "server/transport/session_recording.h"
#include "server/transport/stream_codec.h"
#include "server/transport/upload.h"
#include "warmfront/v1/session.pb.h"

namespace warmfront::server {

class CreateCall final : public grpc::ServerReadReactor<grpc::ByteBuffer>,
                         public Drainable,
                         public std::enable_shared_from_this<CreateCall> {
 public:
  /// Lives until gRPC calls OnDone(). `context` outlives it, `response` lives as long as it does.
  static CreateCall* start(Context& context, const grpc::CallbackServerContext& call,
                           grpc::ByteBuffer& response);

  void OnReadDone(bool ok) override;
  /// What was uploaded is freed at once, and a session that its client will not hear of is not made to the
  /// end, or not kept.
  void OnCancel() override;
  void OnDone() override;

  void notify_draining(std::chrono::system_clock::time_point) override {}
  /// An upload that is whole is built and answered all the same.
  void end(const Fault& fault) override;
  void end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) override;
  void enforce_timeouts(std::chrono::steady_clock::time_point now) override;
  void enforce_rights() override;
  void give_up(const Fault& fault) override;

 private:
  CreateCall(Context& context, const grpc::CallbackServerContext& call, grpc::ByteBuffer& response);

  /// What is thrown in `work` ends the call.
  template <class Work>
  void guarded(Work work) noexcept;
  Outcome<Parsed<v1::CreateSessionRequest>> parse();
  void take(const Outcome<Parsed<v1::CreateSessionRequest>>& parsed);
  void upload_ended();
  std::optional<Fault> add(const v1::CreateSessionRequest& message);
  std::optional<Fault> reserve();
  /// Takes its turn on the runner.
  void build(Lane lane);
  /// The session and the response that tells of it; nothing is to be seen of either yet.
  Outcome<std::shared_ptr<Session>> make(Lane lane);
  void log_created(const Session& session) const;
  void log_refused(const Fault& fault) const;
  /// The call was cancelled after its session was made, and nobody has used that.
  void drop_orphan();
  /// Ends the call with this, unless the session is being built. The upload's memory and its place in the
  /// store are given back first: the client may try again as soon as it hears of it.
  void fail_locked(grpc::Status status) WARMFRONT_REQUIRES(mutex_);
  /// The status that ends the call; counted and logged.
  grpc::Status refused(const Fault& fault) const;
  grpc::Status status_of(const Fault& fault) const noexcept;
  void give_back();

  // Constant after construction.
  Context& context_;
  const grpc::CallbackServerContext& call_;
  grpc::ByteBuffer& response_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();

  // Set by start() before others see the call, then constant.
  Principal principal_;
  std::shared_ptr<Tenant> tenant_;

  std::atomic<bool> given_up_{false};  // stops the building

  // Used by start() and OnDone() only: keeps the call alive in between.
  std::shared_ptr<CreateCall> self_;
  std::optional<Lifecycle::Call> in_flight_;

  // Used by the one outstanding read.
  grpc::ByteBuffer incoming_;

  // Protected by mutex_ until it is being built, then used by build() and OnDone() only.
  Mutex mutex_;
  enum class State {
    kUploading,
    kQueued,  // for its turn on the runner
    kBuilding,
    kFinished
  } state_ WARMFRONT_GUARDED_BY(mutex_) = State::kUploading;
  std::chrono::steady_clock::time_point last_moved_ WARMFRONT_GUARDED_BY(mutex_) = began_;
  bool handling_ WARMFRONT_GUARDED_BY(mutex_) = false;  // a message that came
  std::optional<Gate::Ticket> ticket_;                  // while it is uploaded
  std::optional<Fault> given_up_by_daemon_ WARMFRONT_GUARDED_BY(mutex_);
  std::optional<Upload> upload_;
  std::shared_ptr<Account> account_;
  std::optional<Store::Reservation> reservation_;
  std::shared_ptr<SessionRecording> recording_;
  std::shared_ptr<Session> made_;
};

}  // namespace warmfront::server
