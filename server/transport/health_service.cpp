// SPDX-License-Identifier: Apache-2.0
// Two methods and a list of watches. Thread safety as stated in the header.
#include "server/transport/health_service.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "server/transport/reaction.h"

namespace warmfront::server {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostRequestBytes = 4096;

/// Field 1 of the request: the name. Nothing for what is no request.
std::optional<std::string> name_in(const grpc::ByteBuffer& bytes) {
  namespace pb = google::protobuf;
  using Wire = pb::internal::WireFormatLite;
  constexpr std::uint32_t kName = Wire::MakeTag(1, Wire::WIRETYPE_LENGTH_DELIMITED);
  grpc::Slice slice;
  if (bytes.Length() == 0) return std::string();
  if (bytes.Length() > kMostRequestBytes || !bytes.DumpToSingleSlice(&slice).ok()) return std::nullopt;
  pb::io::CodedInputStream in(slice.begin(), static_cast<int>(slice.size()));
  std::string name;
  while (const std::uint32_t tag = in.ReadTag())
    if (tag == kName ? !Wire::ReadBytes(&in, &name) : !Wire::SkipField(&in, tag)) return std::nullopt;
  return in.ConsumedEntireMessage() ? std::optional(std::move(name)) : std::nullopt;
}

/// Field 1 of the answer: the status.
grpc::ByteBuffer message_of(char status) {
  const std::array<char, 2> bytes{8, status};
  const grpc::Slice slice(bytes.data(), bytes.size());
  return {&slice, 1};
}

grpc::Status no_request() {
  return {grpc::StatusCode::INVALID_ARGUMENT, "a grpc.health.v1.HealthCheckRequest is expected"};
}

}  // namespace

/// Tells its client the latest answer; those that come while one is written are left out but for the last.
class HealthService::Watch final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  Watch(HealthService& health, std::uint64_t key, std::string name)
      : name(std::move(name)), began(Clock::now()), health_(health), key_(key) {}

  const std::string name;
  const Clock::time_point began;

  void tell(Answer answer) {
    const MutexLock lock(mutex_);
    wanted_ = answer;
    write_if_needed();
  }
  void end(const grpc::Status& status) {
    const MutexLock lock(mutex_);
    if (!std::exchange(ended_, true)) finish_call(*this, status);
  }

  bool ended() {
    const MutexLock lock(mutex_);
    return ended_;
  }

  void OnWriteDone(bool ok) override {
    react(
        [&] {
          if (!ok) return end(grpc::Status::CANCELLED);
          const MutexLock lock(mutex_);
          writing_ = false;
          write_if_needed();
        },
        [&](const grpc::Status& status) { end(status); });
  }
  void OnCancel() override { end(grpc::Status::CANCELLED); }
  void OnDone() override { health_.remove(key_); }  // which deletes it

 private:
  void write_if_needed() WARMFRONT_REQUIRES(mutex_) {
    if (ended_ || writing_ || told_ == wanted_) return;
    message_ = message_of(wanted_);
    told_ = wanted_;
    writing_ = true;
    StartWrite(&message_);
  }

  HealthService& health_;
  const std::uint64_t key_;
  Mutex mutex_;
  Answer wanted_ WARMFRONT_GUARDED_BY(mutex_) = kUnknown;
  Answer told_ WARMFRONT_GUARDED_BY(mutex_) = kUnknown;
  bool writing_ WARMFRONT_GUARDED_BY(mutex_) = false;
  bool ended_ WARMFRONT_GUARDED_BY(mutex_) = false;
  grpc::ByteBuffer message_;
};

HealthService::HealthService(std::string service_name, std::size_t most_watches,
                             std::chrono::milliseconds watch_time)
    : service_name_(std::move(service_name)), most_watches_(most_watches), watch_time_(watch_time) {
  using grpc::ByteBuffer;
  using grpc::internal::RpcMethod;
  using Call = grpc::CallbackServerContext;
  // gRPC deletes both.
  AddMethod(
      new grpc::internal::RpcServiceMethod("/grpc.health.v1.Health/Check", RpcMethod::NORMAL_RPC, nullptr));
  MarkMethodRawCallback(0, new grpc::internal::CallbackUnaryHandler<ByteBuffer, ByteBuffer>(
                               [this](Call* call, const ByteBuffer* request, ByteBuffer* response) {
                                 grpc::ServerUnaryReactor* reactor = call->DefaultReactor();
                                 answer(*reactor, [&]() -> grpc::Status {
                                   const std::optional<std::string> name = name_in(*request);
                                   if (!name) return no_request();
                                   const Answer answer = check(*name);
                                   if (answer == kServiceUnknown)
                                     return {grpc::StatusCode::NOT_FOUND, "service name unknown"};
                                   *response = message_of(answer);
                                   return grpc::Status::OK;
                                 });
                                 return reactor;
                               }));
  using Reactor = grpc::ServerWriteReactor<ByteBuffer>;
  AddMethod(new grpc::internal::RpcServiceMethod("/grpc.health.v1.Health/Watch", RpcMethod::SERVER_STREAMING,
                                                 nullptr));
  MarkMethodRawCallback(1, new grpc::internal::CallbackServerStreamingHandler<ByteBuffer, ByteBuffer>(
                               [this](Call*, const ByteBuffer* request) {
                                 return streaming<Reactor>([&]() -> Reactor* {
                                   struct Refused final : Reactor {
                                     void OnDone() override { delete this; }
                                   };
                                   const auto refused = [](const grpc::Status& status) {
                                     auto* reactor = new Refused;
                                     finish_call(*reactor, status);
                                     return reactor;
                                   };
                                   std::optional<std::string> name = name_in(*request);
                                   if (!name) return refused(no_request());
                                   // It is there until OnDone(), which comes after this.
                                   if (const auto made = watch(std::move(*name))) return made.get();
                                   return refused({grpc::StatusCode::RESOURCE_EXHAUSTED,
                                                   "too many health watches; use Check, or watch later"});
                                 });
                               }));
}

HealthService::~HealthService() = default;

HealthService::Answer HealthService::answer_to(std::string_view name) const {
  const bool known = name.empty() || (name == service_name_ && state_ != State::kStarting);
  if (!known) return kServiceUnknown;
  return state_ == State::kStopping ? kNotServing : kServing;
}

HealthService::Answer HealthService::check(std::string_view name) const {
  const MutexLock lock(mutex_);
  return answer_to(name);
}

std::shared_ptr<HealthService::Watch> HealthService::watch(std::string name) {
  std::shared_ptr<Watch> oldest, made;
  {
    const MutexLock lock(mutex_);
    if (watches_.size() >= most_watches_) {
      // One that was ended stays here until gRPC is done with it, and what these hold is bounded, too.
      const auto found = std::ranges::find_if(watches_, [](const auto& one) { return !one.second->ended(); });
      if (found == watches_.end() || watches_.size() >= 2 * most_watches_) return nullptr;
      oldest = found->second;
      if (Clock::now() - oldest->began < watch_time_) return nullptr;
    }
    made = std::make_shared<Watch>(*this, next_key_, std::move(name));
    watches_.emplace(next_key_, made);
    ++next_key_;
    made->tell(answer_to(made->name));
  }
  if (oldest != nullptr)
    oldest->end(
        {grpc::StatusCode::UNAVAILABLE, "there are newer health watches than may be at once; watch again"});
  return made;
}

void HealthService::remove(std::uint64_t key) {
  std::shared_ptr<Watch> gone;  // until the lock is free
  const MutexLock lock(mutex_);
  const auto found = watches_.find(key);
  if (found == watches_.end()) return;
  gone = std::move(found->second);
  watches_.erase(found);
}

void HealthService::set(State state) {
  std::vector<std::pair<std::shared_ptr<Watch>, Answer>> watches;
  {
    const MutexLock lock(mutex_);
    state_ = state;
    for (const auto& [key, watch] : watches_) watches.emplace_back(watch, answer_to(watch->name));
  }
  for (const auto& [watch, answer] : watches) watch->tell(answer);
}

void HealthService::serve() {
  set(State::kServing);
}

void HealthService::stop() {
  set(State::kStopping);
}

}  // namespace warmfront::server
