// SPDX-License-Identifier: Apache-2.0
// A call whose client sends a stream of messages and gets one answer: who may make it, how its messages are
// parsed, and all the ways in which it ends before it is whole. Thread-safe.
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
#include "server/transport/context.h"
#include "server/transport/stream_codec.h"

namespace warmfront::server {

/// `Message` is what is sent: v1::CreateSessionRequest or v1::ChangeSceneRequest.
template <class Message>
class UploadCall : public grpc::ServerReadReactor<grpc::ByteBuffer>,
                   public Drainable,
                   public std::enable_shared_from_this<UploadCall<Message>> {
 public:
  /// Reads the messages of who may send them; ends the call of others. Lives until gRPC calls OnDone().
  static void start(const std::shared_ptr<UploadCall>& call);

  void OnReadDone(bool ok) override;
  /// What was uploaded is freed at once, and what was begun is given up.
  void OnCancel() override;
  void OnDone() override;

  void notify_draining(std::chrono::system_clock::time_point) override {}
  /// An upload that is whole is carried out and answered all the same.
  void end(const Fault& fault) override;
  void end_if_quiet(const Fault& fault, std::chrono::milliseconds quiet) override;
  void enforce_timeouts(std::chrono::steady_clock::time_point now) override;
  void enforce_rights() override;
  void give_up(const Fault& fault) override;

 protected:
  /// `method` names it in messages. `context` outlives it, `response` lives as long as it does.
  UploadCall(const char* method, Context& context, const grpc::CallbackServerContext& call,
             grpc::ByteBuffer& response);

  /// Takes the next message; a fault ends the call.
  virtual std::optional<Fault> add(Message message) WARMFRONT_REQUIRES(mutex_) = 0;
  /// All were taken. A fault ends the call; else the state is kQueued from here on.
  virtual std::optional<Fault> carry_out() WARMFRONT_REQUIRES(mutex_) = 0;
  /// Gives back what it holds: the call ends, or its client does not hear of it any more.
  virtual void give_back() = 0;
  virtual void log_refused(const Fault&) const {}
  /// gRPC is done with it.
  virtual void done() {}

  /// The same object as it is.
  template <class Call>
  std::shared_ptr<Call> self() {
    return std::static_pointer_cast<Call>(this->shared_from_this());
  }
  /// Ends the call with this, unless it is carried out. What it holds is given back first: the client may try
  /// again as soon as it hears of it.
  void fail_locked(grpc::Status status) WARMFRONT_REQUIRES(mutex_);
  /// The status that ends the call; counted and logged.
  grpc::Status refused(const Fault& fault) const;
  grpc::Status status_of(const Fault& fault) const noexcept;

  // Constant after construction.
  const char* const method_;
  Context& context_;
  const grpc::CallbackServerContext& call_;
  grpc::ByteBuffer& response_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();

  // Set by start() before others see the call, then constant.
  Principal principal_;
  std::shared_ptr<Tenant> tenant_;

  const std::shared_ptr<std::atomic<bool>> given_up_ = std::make_shared<std::atomic<bool>>(false);

  // Protected by mutex_ until it is carried out.
  Mutex mutex_;
  enum class State {
    kUploading,
    kQueued,  // for its turn on the runner
    kBegun,   // it is carried out
    kFinished
  } state_ WARMFRONT_GUARDED_BY(mutex_) = State::kUploading;
  std::optional<Gate::Ticket> ticket_;  // while it is uploaded
  std::optional<Fault> given_up_by_daemon_ WARMFRONT_GUARDED_BY(mutex_);

 private:
  /// What is thrown in `work` ends the call.
  template <class Work>
  void guarded(Work work) noexcept;
  Outcome<Parsed<Message>> parse();
  void take(Outcome<Parsed<Message>> parsed);
  void upload_ended();

  // Used by start() and OnDone() only: keeps the call alive in between.
  std::shared_ptr<UploadCall> self_;
  std::optional<Lifecycle::Call> in_flight_;

  // Used by the one outstanding read.
  grpc::ByteBuffer incoming_;

  std::chrono::steady_clock::time_point last_moved_ WARMFRONT_GUARDED_BY(mutex_) = began_;
  bool handling_ WARMFRONT_GUARDED_BY(mutex_) = false;  // a message that came
};

}  // namespace warmfront::server
