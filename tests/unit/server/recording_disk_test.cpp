// SPDX-License-Identifier: Apache-2.0
// Recordings on a disk that hangs: sessions, uploads and timeouts continue, pending data are bounded and
// charged, and when the disk recovers a recording is complete.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <thread>

#include "proto/recording/reader.h"
#include "server/transport/context.h"
#include "server/transport/service.h"
#include "server/transport/session_recording.h"
#include "tests/unit/server/bare_client.h"
#include "tests/unit/server/hanging_disk.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class RecordingDiskTest : public ::testing::Test, protected BareClient {
 protected:
  ~RecordingDiskTest() override {
    disk_->go_on();
    stop();
  }
  /// A service whose recordings wait for the disk.
  void serve(std::size_t queue_bytes = std::size_t{64} << 20) {
    context_ = std::make_unique<server::Context>(limits_, 2, log_, *guard_);
    context_->recordings =
        server::Recordings::open(
            folder_.path(), std::uint64_t{1} << 30, log_,
            {.queue_bytes = queue_bytes, .flush_timeout = flush_timeout_, .put = HangingDisk::put(disk_)})
            .value();
    service_ = server::make_collision_service(*context_);
    const std::string address = "unix:" + (folder_.path() / "d.sock").string();
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    builder.RegisterService(service_.get());
    server_ = builder.BuildAndStart();
    ASSERT_TRUE(server_);
    connect(address);
  }
  void stop() {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
    service_.reset();
    context_.reset();
  }
  static void await(const std::function<bool()>& holds) {
    for (int i = 0; i < 6000; ++i) {
      if (holds()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ADD_FAILURE() << "the condition did not hold within the time limit";
  }
  std::vector<std::string> files() const {
    std::vector<std::string> files;
    for (const auto& file : std::filesystem::directory_iterator(folder_.path()))
      if (file.path().extension() == ".wfrec") files.push_back(file.path());
    return files;
  }
  struct Found {
    std::uint64_t creates = 0, steps = 0, answers = 0;
    bool ended = false, complete = false, in_order = true;
    std::string reason;
  };
  static Found read(const std::string& path) {
    Found found;
    auto opened = recording::Reader::open(path);
    if (!opened) return found;  // nothing was written yet
    recording::Reader reader = std::move(opened).value();
    std::uint64_t last = 0;
    for (auto record = reader.next(); record.ok() && record.value(); record = reader.next()) {
      if (!record.value()->has_end()) {
        found.in_order = found.in_order && record.value()->at_us() >= last;
        last = record.value()->at_us();
      }
      found.creates += record.value()->has_create();
      if (record.value()->has_step()) {
        ++found.steps;
        found.in_order = found.in_order && record.value()->step().frame() == found.steps;
      }
      if (record.value()->has_answer()) {
        ++found.answers;
        found.in_order = found.in_order && record.value()->answer().frame() == found.answers;
      }
      if (!record.value()->has_end()) continue;
      found.ended = true;
      found.complete = record.value()->end().complete();
      found.reason = record.value()->end().reason();
    }
    return found;
  }
  void erase() {
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(kId);
    v1::DeleteSessionResponse response;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &response).ok());
  }
  std::shared_ptr<server::Account> account() {
    const auto sessions = context_->store.list();
    return sessions.size() == 1 ? sessions.front()->account() : nullptr;
  }

  const TemporaryFolder folder_;
  const std::shared_ptr<HangingDisk> disk_ = std::make_shared<HangingDisk>();
  std::chrono::milliseconds flush_timeout_ = std::chrono::seconds(30);
  std::ostringstream text_;
  server::Log log_{server::LogLevel::kInfo, server::LogFormat::kText, &text_};
  server::Limits limits_;
  const std::unique_ptr<server::Guard> guard_ = server::Guard::create({}).value();
  std::unique_ptr<server::Context> context_;
  std::unique_ptr<grpc::Service> service_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(RecordingDiskTest, UploadsStepsAndTimeoutsGoOnWhileItHangs) {
  limits_.write_stall_timeout = std::chrono::milliseconds(1);
  serve();
  ASSERT_TRUE(create().ok()) << "an upload waits for the disk";
  {
    Context context;
    const auto stream = open(context, 1);
    v1::StreamStepsResponse response;
    for (std::uint64_t k = 1; k <= 20; ++k) {
      stream->Write(frame_message(k, frame(k)));
      ASSERT_TRUE(stream->Read(&response)) << "a step waits for the disk";
      EXPECT_EQ(response.answer().frame(), k);
    }
    stream->Write(detach());
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_TRUE(stream->Finish().ok());
  }
  {  // The rest of this upload never comes.
    Context context;
    v1::CreateSessionResponse response;
    const auto upload = stub_->CreateSession(&context, &response);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header(kOther);
    upload->Write(request);
    await([&] { return context_->store.size() == 2; });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    context_->lifecycle.enforce_timeouts();
    EXPECT_EQ(upload->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  erase();
  EXPECT_GT(context_->recordings->queued_bytes(), 20 * frame(1).size()) << "the disk hangs still";
  await([&] { return context_->budget.used() == 0; });  // a session that is gone holds nothing
  disk_->go_on();
  stop();
  const auto recorded = files();
  ASSERT_EQ(recorded.size(), 1u) << "of the session that was created";
  const Found found = read(recorded.front());
  EXPECT_EQ(found.creates, 3u);
  EXPECT_EQ(found.steps, 20u);
  EXPECT_EQ(found.answers, 20u);
  EXPECT_TRUE(found.in_order);
  EXPECT_TRUE(found.ended && found.complete) << found.reason;
  EXPECT_THAT(text_.str(), Not(HasSubstr("recording_stopped")));
}

TEST_F(RecordingDiskTest, AFullQueueStopsTheRecordingAndNotTheSession) {
  constexpr std::size_t kQueue = 64 << 10;
  serve(kQueue);
  ASSERT_TRUE(create().ok());
  auto account = this->account();
  ASSERT_TRUE(account);
  std::uint64_t k = 0;
  while (text_.str().find("recording_stopped") == std::string::npos && k < 1000) {
    const std::size_t waited = context_->recordings->queued_bytes();
    EXPECT_GE(account->held(), waited) << "what waits is on the session's account";
    EXPECT_LE(waited, kQueue);
    ++k;
    ASSERT_TRUE(step(k, frame(k)).ok());
  }
  account.reset();  // its budget is the daemon's
  EXPECT_THAT(text_.str(), HasSubstr("the disk is slower than the sessions"));
  for (std::uint64_t more = k + 10; k < more;) {
    ++k;
    ASSERT_TRUE(step(k, frame(k)).ok()) << "the session goes on";
  }
  EXPECT_LE(context_->recordings->queued_bytes(), kQueue);
  disk_->go_on();
  await([&] { return context_->recordings->queued_bytes() < 2048; });
  erase();
  stop();
  const Found found = read(files().at(0));
  EXPECT_EQ(found.creates, 3u);
  EXPECT_GT(found.steps, 10u);
  EXPECT_LT(found.steps, k - 9);
  EXPECT_TRUE(found.in_order);
  EXPECT_TRUE(found.ended);
  EXPECT_FALSE(found.complete);
  EXPECT_THAT(found.reason, HasSubstr("slower"));
}

TEST_F(RecordingDiskTest, ASmallSessionLosesItsRecordingBeforeItsSteps) {
  // Room for what the threads that take its steps keep for it besides, each some 30 KiB.
  limits_.max_session_bytes = 512 << 10;
  serve();
  ASSERT_TRUE(create().ok());
  for (std::uint64_t k = 1; k <= 500; ++k) {
    const grpc::Status status = step(k, frame(k));
    ASSERT_TRUE(status.ok()) << k << ": " << status.error_message();
  }
  EXPECT_THAT(text_.str(), HasSubstr("what the session may hold"));
}

TEST_F(RecordingDiskTest, ShutdownWaitsNoLongerThanItsLimit) {
  flush_timeout_ = std::chrono::milliseconds(20);
  serve();
  ASSERT_TRUE(create().ok());
  await([&] { return files().size() == 1; });
  stop();
  EXPECT_THAT(text_.str(), HasSubstr("recordings_cut_off"));
  // What its thread does when the disk comes back needs nothing that is gone.
  disk_->go_on();
  await([&] { return read(files().at(0)).ended; });
}

TEST(RecordedPartsTest, WhatAFrameKeepsForItsRecordingIsChargedAndBounded) {
  server::Budget budget(1 << 30);
  const auto account = server::Account::open(budget, 1 << 30, 0).value();
  v1::StepFrame part;
  part.set_positions(std::string(10'000, 'x'));
  {
    server::RecordedParts parts(account);
    for (std::size_t count = 1; count <= 5; ++count) {
      parts.add(part, 60'000);
      EXPECT_GE(account->held(), 10'000 * count);
    }
    parts.add(part, 60'000);
    EXPECT_EQ(account->held(), 0u) << "of too much nothing is kept";
    parts.add(part, 60'000);
    EXPECT_EQ(account->held(), 0u);
  }
  {
    server::RecordedParts parts(account);
    parts.add(part, 60'000);
  }
  EXPECT_EQ(account->held(), 0u);
}

}  // namespace
}  // namespace warmfront::test
