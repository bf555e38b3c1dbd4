// SPDX-License-Identifier: Apache-2.0
// What stands around every reaction, and every reply to a call: nothing that is thrown leaves it.
// Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/status.h>

#include <atomic>
#include <memory>
#include <new>
#include <string>
#include <utility>

namespace warmfront::server {

/// The status that ends a call in which something was thrown, to be asked in the catch block:
/// RESOURCE_EXHAUSTED without memory, INTERNAL for the rest. Without memory for its words too it has two,
/// which need none.
grpc::Status status_of_exception() noexcept;

/// Does the work; what it throws becomes a status, which `failed` ends the call with. gRPC would swallow the
/// exception, and the call would never end: it would hold its session, and a daemon that drains would wait
/// for it.
template <class Work, class Failed>
void react(Work work, Failed failed) noexcept {
  try {
    work();
  } catch (...) {
    failed(status_of_exception());
  }
}

/// Work that nobody misses when there is no memory for it: a line of the log.
template <class Work>
void if_memory_allows(Work work) noexcept {
  try {
    work();
  } catch (...) {
  }
}

/// Ends a reactor's call. gRPC copies the status' words after it has begun to end the call, and could not go
/// back: they are copied here first, and left out when there is no memory for that.
template <class Reactor>
void finish_call(Reactor& reactor, grpc::Status status) noexcept {
  try {
    const std::string message(status.error_message().data(), status.error_message().size());
    const std::string details(status.error_details().data(), status.error_details().size());
  } catch (...) {
    status = status_of_exception();
  }
  reactor.Finish(std::move(status));
}

/// The reactor of a unary call whose client may give up, which sets a flag that the work looks at. Lives
/// until gRPC calls OnDone().
class CancellableCall final : public grpc::ServerUnaryReactor {
 public:
  void OnCancel() override { given_up_->store(true, std::memory_order_relaxed); }
  void OnDone() override { delete this; }
  const std::shared_ptr<std::atomic<bool>>& given_up() const { return given_up_; }

 private:
  const std::shared_ptr<std::atomic<bool>> given_up_ = std::make_shared<std::atomic<bool>>(false);
};

/// Ends a reactor's call with what `respond` returns, having filled the response, or throws.
template <class Reactor, class Respond>
void answer(Reactor& reactor, Respond respond) noexcept {
  try {
    finish_call(reactor, respond());
  } catch (...) {
    finish_call(reactor, status_of_exception());
  }
}

/// A unary method: its reactor, or one that ends the call with what was thrown before there was one.
template <class Method>
grpc::ServerUnaryReactor* unary(grpc::CallbackServerContext& call, Method method) noexcept {
  try {
    return method();
  } catch (...) {
    grpc::ServerUnaryReactor* reactor = call.DefaultReactor();
    finish_call(*reactor, status_of_exception());
    return reactor;
  }
}

/// The same for a method that streams. Null, which gRPC makes UNIMPLEMENTED, when there is no memory at all.
template <class Reactor, class Method>
Reactor* streaming(Method method) noexcept {
  struct Ended final : Reactor {
    void OnDone() override { delete this; }
  };
  try {
    return method();
  } catch (...) {
    auto* reactor = new (std::nothrow) Ended;
    if (reactor != nullptr) finish_call(*reactor, status_of_exception());
    return reactor;
  }
}

}  // namespace warmfront::server
