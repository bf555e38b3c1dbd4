// SPDX-License-Identifier: Apache-2.0
// Messages that are parsed on the runner's threads are answered like all others.
#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/transport/heavy.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

/// Fields that no version knows make any message heavy, and change nothing.
template <class Message>
Message made_heavy(Message message, int fields = 40'000) {
  auto& unknown = *message.GetReflection()->MutableUnknownFields(&message);
  for (int i = 0; i < fields; ++i) unknown.AddVarint(99, 1);
  return message;
}

grpc::ByteBuffer bytes_of_message(const google::protobuf::Message& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

TEST(IsHeavy, ByFieldsAndWhereTheyAreCopiedByBytes) {
  using server::is_heavy;
  using server::Strings;
  v1::StepRequest request;
  const auto heavy = [&](const v1::StepRequest& one, Strings strings) {
    return is_heavy<v1::StepRequest>(bytes_of_message(one), strings);
  };
  request.set_positions(std::string(100'000, 'x'));
  EXPECT_FALSE(heavy(request, Strings::kCopied));
  EXPECT_TRUE(heavy(made_heavy(request), Strings::kLeftInPlace));
  EXPECT_FALSE(heavy(made_heavy(request, 16'000), Strings::kLeftInPlace));
  request.set_positions(std::string(2'000'000, 'x'));
  EXPECT_TRUE(heavy(request, Strings::kCopied));
  EXPECT_FALSE(heavy(request, Strings::kLeftInPlace));
}

class HeavyMessages : public ServiceTest {
 protected:
  v1::StepRequest step_request(std::uint64_t number) const {
    v1::StepRequest request;
    request.set_session_id(kId);
    request.set_frame(number);
    request.set_positions(frame(number));
    return request;
  }
  grpc::Status create_heavy(bool cancel = false) {
    Context context;
    v1::CreateSessionResponse response;
    const auto writer = stub_->CreateSession(&context, &response);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header();
    writer->Write(made_heavy(request));
    if (cancel) context.TryCancel();
    request.set_faces(faces());
    writer->Write(made_heavy(request));
    request.set_positions(frame(0));
    writer->Write(made_heavy(request));
    writer->WritesDone();
    return writer->Finish();
  }
};

TEST_F(HeavyMessages, CreateStepAndChangeASession) {
  ASSERT_TRUE(create_heavy().ok());
  v1::StepResponse response;
  {
    Context context;
    const grpc::Status status = stub_->Step(&context, made_heavy(step_request(1)), &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(hash_of(response.contacts()), local_hashes(grids_, 0, 1).front());
  }
  Context context;
  v1::ChangeSceneRequest change;
  change.set_session_id(kId);
  change.set_next_frame(2);
  v1::ChangeSceneResponse changed;
  const grpc::Status status = stub_->ChangeScene(&context, made_heavy(change), &changed);
  EXPECT_NE(status.error_code(), StatusCode::UNKNOWN) << status.error_message();
  ASSERT_TRUE(step(2, frame(2), &response).ok());
  EXPECT_EQ(hash_of(response.contacts()), local_hashes(grids_, 1, 2).front());
}

TEST_F(HeavyMessages, OnAStreamAreAnsweredInTheirOrder) {
  ASSERT_TRUE(create().ok());
  Context context;
  const auto stream = open(context, 1);
  constexpr std::uint64_t kFrames = 12;
  std::thread writing([&] {
    for (std::uint64_t number = 1; number <= kFrames; ++number) {
      const v1::StreamStepsRequest message = frame_message(number, frame(number));
      stream->Write(number % 3 == 0 ? message : made_heavy(message));
    }
  });
  const std::vector<std::uint64_t> expected = local_hashes(grids_, 0, kFrames);
  for (std::uint64_t number = 1; number <= kFrames; ++number) {
    v1::StreamStepsResponse response;
    ASSERT_TRUE(stream->Read(&response));
    ASSERT_EQ(response.answer().frame(), number);
    EXPECT_EQ(hash_of(response.answer().contacts()), expected[number - 1]);
  }
  writing.join();
  stream->Write(made_heavy(detach()));
  v1::StreamStepsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

// The call may be over before its message's turn comes.
TEST_F(HeavyMessages, OfCallsThatAreGivenUpLeaveNothing) {
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(create_heavy(true).error_code(), StatusCode::CANCELLED);
    Context context;
    std::thread cancelling([&] { context.TryCancel(); });
    v1::StepResponse response;
    EXPECT_FALSE(stub_->Step(&context, made_heavy(step_request(1)), &response).ok());
    cancelling.join();
    Context other;
    const auto stream = stub_->StreamSteps(&other);
    stream->Write(made_heavy(attach(kId)));
    other.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), StatusCode::CANCELLED);
  }
  expect_healthy();
  Context context;
  v1::GetServerInfoResponse info;
  for (int i = 0; i < 500; ++i) {
    Context asking;
    ASSERT_TRUE(stub_->GetServerInfo(&asking, {}, &info).ok());
    if (info.sessions() == 0 && info.charged_bytes() == 0 && info.open_streams() == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(info.sessions(), 0U);
  EXPECT_EQ(info.charged_bytes(), 0U);
  EXPECT_EQ(info.open_streams(), 0U);
}

TEST_F(HeavyMessages, OfIdsAndFlagsAreRefused) {
  Context context;
  v1::GetSessionRequest request;
  request.set_session_id(kId);
  v1::GetSessionResponse response;
  const grpc::Status status = stub_->GetSession(&context, made_heavy(request), &response);
  EXPECT_EQ(status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), ::testing::HasSubstr("send at most 65536"));
}

}  // namespace
}  // namespace warmfront::test
