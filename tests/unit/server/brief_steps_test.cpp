// SPDX-License-Identifier: Apache-2.0
// Brief steps stay on the thread that received them (where_a_step_runs_test.cpp): no request waits for one
// that turns out long.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <latch>
#include <memory>
#include <thread>
#include <vector>

#include "server/transport/context.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

/// Triangles that are apart, so that a step is brief; then all pass through all: a step of minutes that was
/// predicted to be brief, and ends when its client gives up.
class BriefStepsTest : public ServiceTest {
 protected:
  static constexpr std::uint32_t kTriangles = 8000;

  BriefStepsTest() {
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
      for (std::uint32_t corner = 0; corner < 3; ++corner) {
        faces_.push_back(3 * i + corner);
        const double x = corner == 1 ? 1.0 : 0.0, y = corner == 2 ? 1.0 : 0.0;
        for (std::vector<double>* const to : {&apart_, &through_}) to->insert(to->end(), {x, y});
        apart_.push_back(10.0 * i);
        through_.push_back(-1e-3 * i);
      }
    }
  }

  /// A session and its stream, after a brief step.
  struct Streaming {
    std::string id;
    Context context;
    std::unique_ptr<Stream> stream;
  };
  std::unique_ptr<Streaming> stream_soup(int number) {
    auto made = std::make_unique<Streaming>();
    made->id = "31234567-89ab-cdef-0123-" + std::to_string(100000000000 + number);
    v1::SessionHeader spec = header(made->id);
    spec.set_vertex_count(3 * kTriangles);
    spec.set_face_count(kTriangles);
    const grpc::Status created =
        create(spec, {reinterpret_cast<const char*>(faces_.data()), 4 * faces_.size()}, bytes_of(apart_));
    EXPECT_TRUE(created.ok()) << created.error_message();
    made->stream = open(made->context, 1, made->id);
    made->stream->Write(frame_message(1, bytes_of(apart_)));
    v1::StreamStepsResponse response;
    EXPECT_TRUE(made->stream->Read(&response));
    EXPECT_EQ(response.answer().frame(), 1u);
    return made;
  }
  /// Sends the frame that takes minutes and waits until its step, beside `others` like it, is under way.
  void begin_long_step(Streaming& soup, std::uint32_t others = 0) {
    // The brief one counts for a moment after its answer, and is not to be taken for this one.
    await([&] { return info().frames_in_flight() == others; });
    soup.stream->Write(frame_message(2, bytes_of(through_)));
    await([&] { return info().frames_in_flight() == others + 1; });
  }
  static void expect_cancelled(Streaming& soup) {
    soup.context.TryCancel();
    v1::StreamStepsResponse response;
    while (soup.stream->Read(&response)) EXPECT_FALSE(response.has_answer());
    EXPECT_EQ(soup.stream->Finish().error_code(), StatusCode::CANCELLED);
  }

  static void await(const std::function<bool()>& holds) {
    for (int i = 0; i < 3000 && !::testing::Test::HasFailure(); ++i) {
      if (holds()) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ADD_FAILURE() << "the condition did not hold within the time limit";
  }
  v1::GetServerInfoResponse info() {
    Context context;
    v1::GetServerInfoResponse info;
    const grpc::Status status = stub_->GetServerInfo(&context, {}, &info);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return info;
  }
  int count_sessions() {
    Context context;
    v1::ListSessionsResponse response;
    const grpc::Status status = stub_->ListSessions(&context, {}, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.sessions_size();
  }
  /// By grpc.health.v1 of the whole server: an empty request.
  void expect_health_is_told() {
    Context context;
    grpc::CompletionQueue queue;
    grpc::GenericStub generic(channel_);
    grpc::ByteBuffer response;
    const grpc::Slice nothing("");
    const auto call = generic.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check",
                                               grpc::ByteBuffer(&nothing, 1), &queue);
    grpc::Status status;
    call->StartCall();
    call->Finish(&response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    EXPECT_TRUE(queue.Next(&tag, &ok) && ok);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  std::vector<std::uint32_t> faces_;
  std::vector<double> apart_, through_;
};

TEST_F(BriefStepsTest, OthersDoNotWaitForAStepThatIsLongerThanPredicted) {
  // As many as gRPC has threads: they would occupy all of them if allowed.
  const auto count = static_cast<std::uint32_t>(server::Context::polling_threads());
  std::vector<std::unique_ptr<Streaming>> soups;
  for (std::uint32_t i = 0; i < count; ++i) soups.push_back(stream_soup(static_cast<int>(i)));
  for (std::uint32_t i = 0; i < count; ++i) begin_long_step(*soups[i], i);
  ASSERT_FALSE(HasFailure());
  expect_health_is_told();
  EXPECT_EQ(count_sessions(), static_cast<int>(count));
  EXPECT_EQ(session_info(soups.front()->id).last_frame(), 1u);
  // A new session is created, stepped by call and by stream, and deleted.
  expect_healthy();
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  const auto expected = local_hashes(grids_, 0, 10);
  for (std::uint64_t k = 1; k <= expected.size(); ++k) {
    stream->Write(frame_message(k, frame(k)));
    v1::StreamStepsResponse response;
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(hash_of(response.answer().contacts()), expected[k - 1]);
  }
  EXPECT_EQ(info().frames_in_flight(), count) << "none of them has ended meanwhile";
  for (const auto& soup : soups) expect_cancelled(*soup);
  for (const auto& soup : soups) {
    Context again;
    open(again, 2, soup->id, true);
    again.TryCancel();
  }
}

TEST_F(BriefStepsTest, ASmallSessionIsCreatedChangedAndCheckedDuringALongStep) {
  const auto soup = stream_soup(0);
  begin_long_step(*soup);
  v1::SessionHeader spec = header();
  v1::Body& body = *spec.add_bodies();
  body.set_vertex_count(grids_.vertex_count());
  // Whether a thread of the long step runs in between is a matter of timing.
  for (int round = 0; round < 20 && !HasFailure(); ++round) {
    const grpc::Status created = create(spec, faces(), bytes_of(grids_.positions(0)));
    ASSERT_TRUE(created.ok()) << created.error_message();
    Context change_context, check_context, delete_context;
    v1::ChangeSceneRequest change;
    change.set_session_id(kId);
    change.set_next_frame(1);
    v1::BodyAddition& added = *change.add_changes()->mutable_add();
    added.mutable_body()->set_vertex_count(grids_.vertex_count());
    added.set_faces(faces());
    added.set_positions(bytes_of(grids_.positions(1)));
    v1::ChangeSceneResponse changed;
    EXPECT_TRUE(stub_->ChangeScene(&change_context, change, &changed).ok());
    v1::CheckSessionRequest check;
    check.set_session_id(kId);
    v1::CheckSessionResponse checked;
    EXPECT_TRUE(stub_->CheckSession(&check_context, check, &checked).ok());
    v1::DeleteSessionRequest doomed;
    doomed.set_session_id(kId);
    v1::DeleteSessionResponse deleted;
    EXPECT_TRUE(stub_->DeleteSession(&delete_context, doomed, &deleted).ok());
  }
  EXPECT_EQ(info().frames_in_flight(), 1u) << "the long one has not ended meanwhile";
  expect_cancelled(*soup);
}

TEST_F(BriefStepsTest, ARunningOneIsTakenOverWhenItsClientGivesUp) {
  const auto soup = stream_soup(0);
  begin_long_step(*soup);
  Context refused_context, context;
  const auto refused = stub_->StreamSteps(&refused_context);
  refused->Write(attach(soup->id));
  v1::StreamStepsResponse response;
  EXPECT_FALSE(refused->Read(&response));
  EXPECT_EQ(refused->Finish().error_code(), StatusCode::ABORTED);
  const auto taker = stub_->StreamSteps(&context);
  taker->Write(attach(soup->id, true));
  await([&] { return info().open_streams() == 2; });
  expect_cancelled(*soup);
  ASSERT_TRUE(taker->Read(&response));
  EXPECT_EQ(response.attached().expected_frame(), 2u) << "the step was left undone";
  taker->Write(frame_message(2, bytes_of(apart_)));
  ASSERT_TRUE(taker->Read(&response));
  EXPECT_EQ(response.answer().frame(), 2u);
}

TEST_F(BriefStepsTest, ASessionIsDeletedDuringOne) {
  // A step that has been received and has not begun is answered with NOT_FOUND.
  bool in_the_middle = false;
  for (int round = 0; round < 50 && !in_the_middle && !HasFailure(); ++round) {
    const auto soup = stream_soup(round);
    begin_long_step(*soup);
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(soup->id);
    v1::DeleteSessionResponse deleted;
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
    EXPECT_EQ(count_sessions(), 0);
    soup->context.TryCancel();
    v1::StreamStepsResponse response;
    while (soup->stream->Read(&response)) EXPECT_FALSE(response.has_answer());
    in_the_middle = soup->stream->Finish().error_code() == StatusCode::CANCELLED;
    // The session's memory is freed with its job, on the thread that ran it.
    await([&] { return info().charged_bytes() == 0; });
  }
  EXPECT_TRUE(in_the_middle);
}

TEST_F(BriefStepsTest, ADrainIsAnnouncedDuringOneAndEndsAfterIt) {
  const auto soup = stream_soup(0);
  begin_long_step(*soup);
  std::promise<bool> drained;
  std::thread drain([&] { drained.set_value(daemon_->drain()); });
  v1::StreamStepsResponse response;
  EXPECT_TRUE(soup->stream->Read(&response));
  EXPECT_TRUE(response.has_draining());
  EXPECT_EQ(create().error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(info().frames_in_flight(), 1u);
  expect_cancelled(*soup);
  drain.join();
  EXPECT_TRUE(drained.get_future().get()) << "no call was cut off";
}

TEST_F(BriefStepsTest, StreamsOfThemLeaveRoomForCallsOfEveryKind) {
  constexpr std::uint64_t kFrames = 60;
  const auto expected = local_hashes(grids_, 0, kFrames);
  const auto window = static_cast<std::uint64_t>(server::Limits{}.window);
  std::atomic<int> streaming{4};
  std::vector<std::string> ids;
  for (int i = 0; i < streaming; ++i) {
    ids.push_back("41234567-89ab-cdef-0123-" + std::to_string(100000000000 + i));
    ASSERT_TRUE(create(ids.back()).ok());
  }
  std::vector<std::thread> clients;
  for (const std::string& id : ids) {
    clients.emplace_back([&, id] {
      Context context;
      const auto stream = open(context, 1, id);
      v1::StreamStepsResponse response;
      std::uint64_t sent = 0;
      for (std::uint64_t k = 1; k <= kFrames; ++k) {
        while (sent < kFrames && sent < k - 1 + window) {
          ++sent;
          stream->Write(frame_message(sent, frame(sent)));
        }
        if (!stream->Read(&response)) break;
        EXPECT_EQ(hash_of(response.answer().contacts()), expected[k - 1]) << k;
      }
      stream->Write(detach());
      EXPECT_FALSE(stream->Read(&response));
      EXPECT_TRUE(stream->Finish().ok());
      --streaming;
    });
  }
  do {
    expect_health_is_told();
    EXPECT_EQ(count_sessions(), static_cast<int>(ids.size()));
    for (const std::string& id : ids) EXPECT_LE(session_info(id).last_frame(), kFrames);
  } while (streaming > 0 && !HasFailure());
  for (std::thread& client : clients) client.join();
  for (const std::string& id : ids) EXPECT_EQ(session_info(id).steps(), kFrames);
}

}  // namespace
}  // namespace warmfront::test
