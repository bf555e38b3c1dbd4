// SPDX-License-Identifier: Apache-2.0
// StreamSteps as a client sees it that does not use our library: pipelining, errors in band, garbage,
// takeover, drain.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>
#include <thread>

#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

TEST_F(ServiceTest, AStreamPipelinesAndKeepsTheOrderOverErrors) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  std::string bad = frame(2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(bad.data() + 8 * (3 * 4 + 2), &nan, 8);
  stream->Write(frame_message(1, frame(1)));
  stream->Write(frame_message(2, bad));
  stream->Write(frame_message(3, frame(3)));
  // Frame 2 once more, in three parts that end within a number.
  const std::string good = frame(2);
  stream->Write(frame_message(2, good.substr(0, 5), true));
  stream->Write(frame_message(2, good.substr(5, 100), true));
  stream->Write(frame_message(2, good.substr(105)));
  stream->Write(detach());
  v1::StreamStepsResponse response;
  const auto expected = local_hashes(grids_, 0, 2);
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected[0]);
  EXPECT_TRUE(response.answer().last());
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(response.error().frame(), 2u);
  EXPECT_THAT(response.error().status().message(), HasSubstr("4"));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(response.error().status()).expected_frame(), 2u);
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), expected[1]);
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok()) << "a detach ends well";
}

TEST_F(ServiceTest, MessagesOutOfPlaceEndTheStreamAndNotTheSession) {
  ASSERT_TRUE(create().ok());
  const auto ends_with = [&](const std::vector<v1::StreamStepsRequest>& requests) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    for (const auto& request : requests)
      if (!stream->Write(request)) break;
    stream->WritesDone();
    v1::StreamStepsResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  };
  EXPECT_EQ(ends_with({frame_message(1, frame(1))}).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kId), attach(kId)}).error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kOther)}).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(ends_with({attach("x")}).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ends_with({attach(kId), frame_message(1, "abc", true), frame_message(2, "abc")}).error_code(),
            StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ends_with({attach(kId), frame_message(1, "abc", true)}).error_code(),
            StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(ends_with({attach(kId)}).ok()) << "a half-close has the effect of a detach";
  EXPECT_TRUE(ends_with({}).ok());
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(ServiceTest, GarbageOnAStreamIsInvalidArgumentAndTheSessionLives) {
  ASSERT_TRUE(create().ok());
  grpc::GenericStub generic(channel_);
  std::mt19937 random(3);
  const std::string whole = frame_message(1, std::string(40, 'p')).SerializeAsString();
  for (int round = 0; round < 60; ++round) {
    // Truncations of a real message, then random bytes of a wire type that does not exist.
    std::string garbage;
    if (round < 30) {
      garbage = whole.substr(0, whole.size() - 1 - static_cast<std::size_t>(round));
    } else {
      garbage.resize(1 + random() % 200, '\x07');
      for (std::size_t i = 1; i < garbage.size(); ++i) garbage[i] = static_cast<char>(random());
    }
    Context context;
    grpc::CompletionQueue queue;
    const auto call = generic.PrepareCall(&context, "/warmfront.v1.CollisionService/StreamSteps", &queue);
    const auto wait = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    const auto write = [&](const std::string& bytes) {
      const grpc::Slice slice(bytes);
      call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      return wait();
    };
    call->StartCall(nullptr);
    ASSERT_TRUE(wait());
    if (round % 2 == 0) {
      ASSERT_TRUE(write(attach(kId, true).SerializeAsString()));
    }
    write(garbage);
    // The status comes after whatever was answered before.
    grpc::ByteBuffer answer;
    do {
      call->Read(&answer, nullptr);
    } while (wait());
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT) << round << ": " << status.error_message();
    queue.Shutdown();
  }
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(ServiceTest, ASessionHasOneStreamUnlessItIsTakenOver) {
  ASSERT_TRUE(create().ok());
  Context first, second, third;
  const auto holder = open(first, 1);
  const auto refused = stub_->StreamSteps(&second);
  refused->Write(attach(kId));
  v1::StreamStepsResponse response;
  EXPECT_FALSE(refused->Read(&response));
  const grpc::Status status = refused->Finish();
  EXPECT_EQ(status.error_code(), StatusCode::ABORTED);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_SESSION_ATTACHED);
  const auto taker = open(third, 1, kId, true);
  EXPECT_FALSE(holder->Read(&response));
  EXPECT_EQ(holder->Finish().error_code(), StatusCode::ABORTED);
  taker->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(taker->Read(&response));
  EXPECT_EQ(response.answer().frame(), 1u);
}

// A client gave a stream up and attached with another one, and the daemon sees the first one's attach last:
// it took over from its successor, whose frame then failed with ABORTED.
TEST_F(ServiceTest, AnAttachThatComesLateDoesNotTakeOverFromItsSuccessor) {
  ASSERT_TRUE(create().ok());
  const auto claim = [](const std::string& client, std::uint64_t attempt) {
    v1::StreamStepsRequest request = attach(kId, true);
    request.mutable_attach()->set_client_id(client);
    request.mutable_attach()->set_attempt(attempt);
    return request;
  };
  v1::StreamStepsResponse response;
  const auto refused = [&](const v1::StreamStepsRequest& request) {
    Context context;
    const auto stream = stub_->StreamSteps(&context);
    stream->Write(request);
    EXPECT_FALSE(stream->Read(&response));
    return stream->Finish();
  };
  Context first, second;
  const auto holder = stub_->StreamSteps(&first);
  holder->Write(claim("a", 2));
  ASSERT_TRUE(holder->Read(&response));
  for (const std::uint64_t late : {1, 2}) {
    const grpc::Status status = refused(claim("a", late));
    EXPECT_EQ(status.error_code(), StatusCode::ABORTED);
    EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_SESSION_ATTACHED);
    EXPECT_THAT(status.error_message(), HasSubstr("attach " + std::to_string(late) + " of this client"));
  }
  holder->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(holder->Read(&response)) << "who came late has taken nothing";
  EXPECT_EQ(response.answer().frame(), 1u);
  const auto other = stub_->StreamSteps(&second);
  other->Write(claim("b", 1));
  ASSERT_TRUE(other->Read(&response)) << "another client's attempts are its own";
  EXPECT_FALSE(holder->Read(&response));
  EXPECT_EQ(holder->Finish().error_code(), StatusCode::ABORTED);

  EXPECT_THAT(refused(claim(std::string(65, 'c'), 1)).error_message(), HasSubstr("client_id has 65 bytes"));
  EXPECT_EQ(refused(claim("c", 0)).error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(refused(claim("", 1)).error_code(), StatusCode::INVALID_ARGUMENT);
  other->Write(frame_message(2, frame(2)));
  ASSERT_TRUE(other->Read(&response));
  EXPECT_EQ(response.answer().frame(), 2u);
}

TEST_F(ServiceTest, DeletingASessionEndsItsStream) {
  ASSERT_TRUE(create().ok());
  Context context, remove;
  const auto stream = open(context, 1);
  v1::DeleteSessionRequest request;
  request.set_session_id(kId);
  v1::DeleteSessionResponse deleted;
  ASSERT_TRUE(stub_->DeleteSession(&remove, request, &deleted).ok());
  v1::StreamStepsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), StatusCode::NOT_FOUND);
  // That is logged as the end of the session.
  daemon_.stop();
  EXPECT_THAT(daemon_.log(), HasSubstr("\"event\":\"session_closed\""));
  EXPECT_THAT(daemon_.log(), HasSubstr("\"level\":\"debug\",\"event\":\"stream_ended\""));
}

TEST_F(ServiceTest, AVanishedClientLeavesTheSessionToTheNext) {
  ASSERT_TRUE(create().ok());
  {
    Context context;
    const auto stream = open(context, 1);
    stream->Write(frame_message(1, frame(1)));
    context.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
  }
  // Frame 1 may or may not have been read before the end; both are fine, and the session is not blocked for
  // long.
  Context context;
  auto stream = stub_->StreamSteps(&context);
  stream->Write(attach(kId, true));
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_LE(response.attached().expected_frame(), 2u);
  stream->Write(frame_message(1, frame(1)));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 1).front());
}

TEST_F(SmallLimitsTest, AnswersComeInChunksAndManyFramesThroughAWindowOfOne) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  const auto expected = local_hashes(grids_, 0, 8);
  // All are sent at once: what is beyond the window waits unread.
  for (std::uint64_t k = 1; k <= 8; ++k) ASSERT_TRUE(stream->Write(frame_message(k, frame(k))));
  for (std::uint64_t k = 1; k <= 8; ++k) {
    v1::ContactColumns all;
    v1::StreamStepsResponse response;
    std::size_t chunks = 0;
    do {
      ASSERT_TRUE(stream->Read(&response));
      ASSERT_EQ(response.answer().frame(), k);
      const v1::ContactColumns& part = response.answer().contacts();
      EXPECT_LE(part.kind().size(), 2u) << "64 bytes are two rows";
      all.mutable_kind()->append(part.kind());
      all.mutable_status()->append(part.status());
      all.mutable_v()->append(part.v());
      all.mutable_toi()->append(part.toi());
      ++chunks;
    } while (!response.answer().last());
    EXPECT_GT(chunks, 2u);
    EXPECT_EQ(response.answer().summary().rows(), all.kind().size());
    EXPECT_EQ(hash_of(all), expected[k - 1]);
  }
}

TEST_F(ServiceTest, DrainRefusesNewCallsNotifiesStreamsAndDeliversWhatIsInHand) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  for (std::uint64_t k = 1; k <= 3; ++k) stream->Write(frame_message(k, frame(k)));
  v1::StreamStepsResponse response;
  // The first answer shows that the frames arrived.
  ASSERT_TRUE(stream->Read(&response));
  bool drained = false;
  std::thread drain([&] { drained = daemon_->drain(); });
  std::uint64_t answered = 1;
  bool noticed = false;
  while (stream->Read(&response)) {
    if (response.has_draining()) noticed = true;
    if (response.has_answer()) {
      EXPECT_EQ(response.answer().frame(), ++answered);
    }
  }
  const grpc::Status status = stream->Finish();
  drain.join();
  EXPECT_TRUE(noticed);
  EXPECT_EQ(answered, 3u);
  EXPECT_EQ(status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_DRAINING);
  EXPECT_TRUE(drained);
  EXPECT_EQ(create(kOther).error_code(), StatusCode::UNAVAILABLE);
}

TEST_F(ServiceTest, OfADrainTheEndOfEveryStreamIsLoggedWithItsSessionAndItsCodesName) {
  ASSERT_TRUE(create().ok());
  Context context, late_context;
  const auto stream = open(context, 1);
  std::thread drain([&] { daemon_->drain(); });
  v1::StreamStepsResponse response;
  EXPECT_TRUE(stream->Read(&response) && response.has_draining());
  // One that comes now is refused before it attaches; the other heeds the notice.
  late_context.AddMetadata("warmfront-session", kOther);
  EXPECT_EQ(stub_->StreamSteps(&late_context)->Finish().error_code(), StatusCode::UNAVAILABLE);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  drain.join();
  daemon_.stop();
  const auto ended = [](const char* session, const char* attached, const char* code) {
    return std::string("\"level\":\"info\",\"event\":\"stream_ended\",\"session\":\"") + session +
           "\",\"attached\":" + attached + ",\"principal\":\"\",\"code\":" + code;
  };
  EXPECT_THAT(daemon_.log(), HasSubstr(ended(kId, "true", "0,\"code_name\":\"OK\"")));
  EXPECT_THAT(daemon_.log(), HasSubstr(ended(kOther, "false", "14,\"code_name\":\"UNAVAILABLE\"")));
}

}  // namespace
}  // namespace warmfront::test
