// SPDX-License-Identifier: Apache-2.0
// grpc.health.v1: the reported states and their times, and that watches are bounded.
#include "server/transport/health_service.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using namespace std::string_literals;
using grpc::StatusCode;
using server::HealthService;

constexpr int kServing = 1, kNotServing = 2, kServiceUnknown = 3;

grpc::ByteBuffer buffer_of(const std::string& text) {
  const grpc::Slice slice(text);
  return {&slice, 1};
}

std::string request_of(const std::string& name) {
  return "\x0a"s + static_cast<char>(name.size()) + name;
}

int status_in(const grpc::ByteBuffer& bytes) {
  grpc::Slice slice;
  if (!bytes.DumpToSingleSlice(&slice).ok() || slice.size() != 2 || slice.begin()[0] != 8) return -1;
  return slice.begin()[1];
}

/// A call of grpc.health.v1.Health that is written and read by hand.
class Call {
 public:
  Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& request)
      : stub_(channel) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/" + method, &queue_);
    call_->StartCall(nullptr);
    wait();
    call_->WriteLast(buffer_of(request), {}, nullptr);
    wait();
  }
  /// The next answer; -1 when there is none.
  int read() {
    grpc::ByteBuffer answer;
    call_->Read(&answer, nullptr);
    return wait() ? status_in(answer) : -1;
  }
  grpc::Status finish() {
    grpc::Status status;
    call_->Finish(&status, nullptr);
    wait();
    return status;
  }
  void cancel() { context_.TryCancel(); }

 private:
  bool wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

class HealthTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kMost = 3;
  static constexpr std::chrono::milliseconds kTime{300};

  HealthTest() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&health_);
    server_ = builder.BuildAndStart();
    channel_ = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
  }
  std::unique_ptr<Call> call(const std::string& method, const std::string& request) {
    return std::make_unique<Call>(channel_, method, request);
  }
  std::unique_ptr<Call> watch(const std::string& name) { return call("Watch", request_of(name)); }
  int check(const std::string& name) { return call("Check", request_of(name))->read(); }

  const TemporaryFolder folder_;
  const std::string address_ = "unix:" + (folder_.path() / "h.sock").string();
  HealthService health_{"a.Service", kMost, kTime};
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(HealthTest, ChecksAndWatchesAreToldTheSame) {
  const auto whole = watch(""), service = watch("a.Service"), other = watch("b.Service");
  EXPECT_EQ(whole->read(), kServing);
  EXPECT_EQ(service->read(), kServiceUnknown);
  EXPECT_EQ(other->read(), kServiceUnknown);
  EXPECT_EQ(check(""), kServing);
  const auto early = call("Check", request_of("a.Service"));
  EXPECT_EQ(early->read(), -1);
  EXPECT_EQ(early->finish().error_code(), StatusCode::NOT_FOUND);
  health_.serve();
  EXPECT_EQ(service->read(), kServing);
  EXPECT_EQ(check("a.Service"), kServing);
  health_.stop();
  EXPECT_EQ(whole->read(), kNotServing);
  EXPECT_EQ(service->read(), kNotServing);
  EXPECT_EQ(check(""), kNotServing);
  EXPECT_EQ(check("a.Service"), kNotServing);
  const auto late = call("Check", request_of("b.Service"));
  EXPECT_EQ(late->read(), -1);
  EXPECT_EQ(late->finish().error_code(), StatusCode::NOT_FOUND);
  // A server that ends ends them.
  server_->Shutdown(std::chrono::system_clock::now());
  EXPECT_EQ(other->read(), -1);
  EXPECT_FALSE(other->finish().ok());
}

TEST_F(HealthTest, EveryEncodingOfANameIsReadAndOtherBytesAreRefused) {
  health_.serve();
  for (const std::string& request : {""s, "\x0a\x00"s, "\x10\x05"s,
                                     "\x0a\x01x\x0a\x09"
                                     "a.Service"s,
                                     "\x0a\x09"
                                     "a.Service\x1a\x02yz"s})
    EXPECT_EQ(call("Check", request)->read(), kServing) << request;
  for (const std::string& request : {"\x0a"s, "\x0a\x05x"s, "\xff"s, "\x0a\xff\xff\xff\xff\x0f"s, "\x0c"s,
                                     request_of(std::string(100, 'x')) + std::string(5000, '\0')})
    for (const char* method : {"Check", "Watch"}) {
      const auto refused = call(method, request);
      EXPECT_EQ(refused->read(), -1);
      EXPECT_EQ(refused->finish().error_code(), StatusCode::INVALID_ARGUMENT) << request;
    }
}

TEST_F(HealthTest, ANewWatchEndsTheOldestOnceThatHasHadItsTime) {
  std::vector<std::unique_ptr<Call>> watches;
  for (std::size_t i = 0; i < kMost; ++i) {
    watches.push_back(watch(""));
    EXPECT_EQ(watches.back()->read(), kServing);
  }
  // One that comes too early, unless this machine was too busy for that, is refused; later ones are not.
  grpc::Status refused;
  std::unique_ptr<Call> next;
  for (int i = 0; i < 1000; ++i) {
    next = watch("");
    if (next->read() == kServing) break;
    refused = next->finish();
    EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(watches[0]->read(), -1);
  const grpc::Status ended = watches[0]->finish();
  EXPECT_EQ(ended.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_THAT(ended.error_message(), ::testing::HasSubstr("watch again"));
  health_.stop();
  for (Call* one : {watches[1].get(), watches[2].get(), next.get()}) EXPECT_EQ(one->read(), kNotServing);
}

TEST_F(HealthTest, CancelledWatchesAreNotCounted) {
  for (int i = 0; i < 50; ++i) {
    std::unique_ptr<Call> one;
    // The place of the one before is free a moment after it was given up.
    for (int attempt = 0; attempt < 1000; ++attempt) {
      one = watch("a.Service");
      if (one->read() == kServiceUnknown) break;
      one->finish();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    one->cancel();
    EXPECT_FALSE(one->finish().ok());
  }
}

}  // namespace
}  // namespace warmfront::test
