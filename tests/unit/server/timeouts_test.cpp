// SPDX-License-Identifier: Apache-2.0
// Clients that are slow or cancel: they are disconnected after the stated time with the stated code, without
// cost to others.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

class SlowClientTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    // Long enough for what is sent at once on a busy machine.
    config.limits.upload_timeout = milliseconds(2000);
    config.limits.window = 2;
    return config;
  }
  SlowClientTest() : ServiceTest(config()) {}
};

TEST_F(SlowClientTest, AnUploadThatDoesNotEndIsRefusedAndLeavesItsPlace) {
  Context context;
  v1::CreateSessionResponse response;
  const auto writer = stub_->CreateSession(&context, &response);
  v1::CreateSessionRequest request;
  *request.mutable_header() = header();
  writer->Write(request);
  request.set_faces(faces());
  writer->Write(request);
  const grpc::Status status = writer->Finish();  // without WritesDone(): the client is not done
  EXPECT_EQ(status.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_TIMEOUT);
  EXPECT_THAT(status.error_message(), HasSubstr("--upload-timeout"));
  EXPECT_TRUE(create().ok()) << "the id is free again";
  expect_healthy();
}

TEST_F(SlowClientTest, AStreamThatNeverAttachesAndAFrameThatNeverEndsAreCutOff) {
  ASSERT_TRUE(create().ok());
  Context silent, slow;
  const auto never = stub_->StreamSteps(&silent);
  v1::StreamStepsResponse response;
  EXPECT_FALSE(never->Read(&response));
  const grpc::Status first = never->Finish();
  EXPECT_EQ(first.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(detail_of(first).reason(), v1::ERROR_REASON_TIMEOUT);
  const auto stream = open(slow, 1);
  // Idle time between frames is allowed.
  std::this_thread::sleep_for(milliseconds(2500));
  stream->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(stream->Read(&response));
  // Single bytes at long intervals do not extend the time.
  for (int i = 0; i < 1000 && stream->Write(frame_message(2, "x", true)); ++i)
    std::this_thread::sleep_for(milliseconds(20));
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status second = stream->Finish();
  EXPECT_EQ(second.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_THAT(second.error_message(), HasSubstr("the rest of a frame"));
  EXPECT_TRUE(step(2, frame(2)).ok()) << "the session is as before the incomplete frame";
}

/// Answers larger than the transport's buffers for a client that does not read.
class NoReaderTest : public ServiceTest {
 protected:
  // Only the stall is timed, and long enough for a client that does read on a busy machine: an upload of this
  // size takes as long as it takes.
  static server::Config config() {
    server::Config config;
    config.limits.write_stall_timeout = std::chrono::seconds(1);
    config.limits.window = 2;
    return config;
  }
  NoReaderTest() : ServiceTest(config()) {}
  const MovingGrids large_{220};
};

TEST_F(NoReaderTest, AClientThatNeverReadsIsCutOffAndItsSessionKept) {
  v1::SessionHeader spec = header();
  spec.set_vertex_count(large_.vertex_count());
  const SceneDescription scene = large_.scene();
  spec.set_face_count(static_cast<std::uint32_t>(scene.faces.size()));
  // Uploads of this size need their time, so the frames come by a session of another number format: all at
  // once.
  ASSERT_TRUE(create(spec, {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12},
                     bytes_of(large_.positions(0)))
                  .ok());
  // A connection of its own with small windows: what it does not read stays in the daemon.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto channel =
      grpc::CreateCustomChannel(daemon_.address(), grpc::InsecureChannelCredentials(), arguments);
  const auto stub = v1::CollisionService::NewStub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(300));
  const auto stream = stub->StreamSteps(&context);
  stream->Write(attach(kId));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  stream->Write(frame_message(1, bytes_of(large_.positions(1))));
  stream->Write(frame_message(2, bytes_of(large_.positions(2))));
  // The client does not read. The daemon ends the stream, and the session can be attached again.
  v1::GetSessionResponse session;
  for (int i = 0; i < 20'000; ++i) {  // a slow machine computes for a minute before it writes
    Context poll;
    v1::GetSessionRequest request;
    request.set_session_id(kId);
    ASSERT_TRUE(stub_->GetSession(&poll, request, &session).ok());
    if (!session.session().attached()) break;
    std::this_thread::sleep_for(milliseconds(10));
  }
  ASSERT_FALSE(session.session().attached());
  EXPECT_GE(session.session().last_frame(), 1u);
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_THAT(status.error_message(), HasSubstr("--write-stall-timeout"));
  // What was queued is free: only the last answer is kept.
  Context again;
  const auto next = stub_->StreamSteps(&again);
  next->Write(attach(kId));
  ASSERT_TRUE(next->Read(&response));
  const std::uint64_t expected = response.attached().expected_frame();
  EXPECT_GE(expected, 2u);
  next->Write(frame_message(expected, bytes_of(large_.positions(expected))));
  v1::ContactColumns all;
  do {
    ASSERT_TRUE(next->Read(&response));
    ASSERT_TRUE(response.has_answer());
    all.mutable_kind()->append(response.answer().contacts().kind());
    all.mutable_status()->append(response.answer().contacts().status());
    all.mutable_v()->append(response.answer().contacts().v());
    all.mutable_toi()->append(response.answer().contacts().toi());
  } while (!response.answer().last());
  EXPECT_EQ(hash_of(all), local_hashes(large_, expected - 1, expected).back());
  expect_healthy();
}

}  // namespace
}  // namespace warmfront::test
