// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 13, 21 and 22: more than the limits allow, and clients that do not read or hardly send.
#include <chrono>
#include <thread>

#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;

std::string id_of(int number) {
  return "41234567-89ab-cdef-0123-" + std::to_string(100'000'000'000 + number);
}

TEST_F(FaultTable, Row13_MoreSessionsOrMemoryThanAllowed) {
  begin({"--max-sessions", "4", "--max-session-bytes", "1MiB", "--max-total-bytes", "8MiB"});
  const auto refused = [&](const grpc::Status& status, const char* words) {
    expect_fault(status, StatusCode::RESOURCE_EXHAUSTED, v1::ERROR_REASON_LIMIT, words);
  };
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(create(id_of(i)).ok());
  for (int i = 3; i < 20; ++i) {
    const grpc::Status full = create(id_of(i));
    refused(full, "--max-sessions");
    EXPECT_GT(detail_of(full).retry_after_ms(), 0U) << "it may pass";
  }
  Context context;
  v1::DeleteSessionRequest request;
  request.set_session_id(id_of(0));
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
  // There is a place again, and not for a scene that would not fit into a session's memory.
  const MovingGrids large(150);
  const SceneDescription scene = large.scene();
  v1::SessionHeader wanted = header(id_of(1000));
  wanted.set_vertex_count(large.vertex_count());
  wanted.set_face_count(static_cast<std::uint32_t>(scene.faces.size()));
  refused(create(wanted, {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12},
                 bytes_of(large.positions(0))),
          "--max-session-bytes");
  EXPECT_TRUE(create(id_of(0)).ok());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(step(1, frame(1), nullptr, id_of(i)).ok());
}

TEST_F(FaultTable, Row21_ClientNeverReads) {
  begin({"--write-stall-timeout", "500ms", "--max-queued-bytes", "4MiB"});
  allowed_peak_ = allowed_growth_ = 128 * kMiB;  // a scene of 77,000 triangles and its answers are in it
  const MovingGrids large(140);
  const SceneDescription scene = large.scene();
  v1::SessionHeader wanted = header();
  wanted.set_vertex_count(large.vertex_count());
  wanted.set_face_count(static_cast<std::uint32_t>(scene.faces.size()));
  ASSERT_TRUE(create(wanted, {reinterpret_cast<const char*>(scene.faces.data()), scene.faces.size() * 12},
                     bytes_of(large.positions(0)))
                  .ok());
  // Small windows: what is not read stays in the daemon.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 64 << 10);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateCustomChannel(daemon_->socket(), grpc::InsecureChannelCredentials(), arguments));
  Context context;
  const auto stream = stub->StreamSteps(&context);
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Write(attach(kId)) && stream->Read(&response));
  std::uint64_t sent = 0;
  while (sent < 30 && stream->Write(frame_message(sent + 1, bytes_of(large.positions(sent + 1))))) ++sent;
  step_untouched();
  // The client does not read until the daemon has ended the stream. Data sent before can still be read; then
  // the stream's status has the reason.
  v1::GetSessionRequest request;
  request.set_session_id(kId);
  v1::GetSessionResponse session;
  for (int i = 0; i < 2000; ++i) {
    Context info_context;
    ASSERT_TRUE(stub_->GetSession(&info_context, request, &session).ok());
    if (!session.session().attached()) break;
    std::this_thread::sleep_for(10ms);
  }
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE) << status.error_message();
  EXPECT_FALSE(session.session().attached());
  EXPECT_LT(session.session().last_frame(), 30U) << "frames beyond what could be answered were not read";
  std::printf("%lu frames written, %lu stepped\n", static_cast<unsigned long>(sent),
              static_cast<unsigned long>(session.session().last_frame()));
}

TEST_F(FaultTable, Row22_SlowUploadAttachOrFrame) {
  begin({"--upload-timeout", "2s"});  // enough for what is sent at once on a busy machine
  {
    Context context;
    v1::CreateSessionResponse response;
    const auto upload = stub_->CreateSession(&context, &response);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header();
    bool open = upload->Write(request);
    // A byte at a time, for up to ten times the allowed time.
    for (int i = 0; open && i < 500; ++i) {
      request.set_faces(faces().substr(static_cast<std::size_t>(i), 1));
      open = upload->Write(request);
      std::this_thread::sleep_for(40ms);
    }
    EXPECT_FALSE(open);
    EXPECT_EQ(upload->Finish().error_code(), StatusCode::DEADLINE_EXCEEDED);
  }
  ASSERT_TRUE(create().ok()) << "the place and the id are free again";
  {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    v1::StreamStepsResponse response;
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_EQ(stream->Finish().error_code(), StatusCode::DEADLINE_EXCEEDED) << "a stream that never attaches";
  }
  Context context;
  const auto stream = open(context, 1);
  for (int i = 0; i < 500 && stream->Write(frame_message(1, "x", true)); ++i)
    std::this_thread::sleep_for(40ms);
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::DEADLINE_EXCEEDED) << "a frame that never ends";
  EXPECT_TRUE(step(1, frame(1)).ok());
}

}  // namespace
}  // namespace warmfront::test
