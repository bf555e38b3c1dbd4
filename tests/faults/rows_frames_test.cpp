// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 8 to 12: frames out of order, unexpected messages, sessions that are unknown or held by
// another client.
#include <chrono>
#include <thread>

#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

TEST_F(FaultTable, Row08_FrameGapOrBackwards) {
  ASSERT_TRUE(create().ok());
  ASSERT_TRUE(step(1, frame(1)).ok() && step(2, frame(2)).ok());
  for (const std::uint64_t wrong :
       {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{4}, std::numeric_limits<std::uint64_t>::max()}) {
    const grpc::Status status = step(wrong, frame(3));
    expect_fault(status, StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_FRAME_OUT_OF_ORDER,
                 "frame 3 is expected");
    EXPECT_EQ(detail_of(status).expected_frame(), 3U);
  }
  Context context;
  const auto stream = open(context, 3);
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Write(frame_message(9, frame(3))) && stream->Read(&response));
  EXPECT_EQ(response.error().status().code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(response.error().status()).expected_frame(), 3U);
  ASSERT_TRUE(stream->Write(frame_message(3, frame(3))) && stream->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 3).back());
}

TEST_F(FaultTable, Row09_TheSameFrameAgain) {
  ASSERT_TRUE(create().ok());
  v1::StepResponse first, again;
  ASSERT_TRUE(step(1, frame(1), &first).ok());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(step(1, frame(1), &again).ok());
    EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString())
        << "one answer a frame, however often it is asked for";
    expect_fault(step(1, frame(2)), StatusCode::ABORTED, v1::ERROR_REASON_FRAME_CHANGED, "frame 1");
  }
  ASSERT_TRUE(step(2, frame(2), &again).ok());
  EXPECT_EQ(hash_of(again.contacts()), local_hashes(grids_, 0, 2).back());
}

TEST_F(FaultTable, Row10_StepBeforeAttachAndASecondAttach) {
  ASSERT_TRUE(create().ok());
  const std::string step_bytes = frame_message(1, frame(1)).SerializeAsString(),
                    attach_bytes = attach(kId).SerializeAsString();
  expect_fault(raw_call("StreamSteps", {step_bytes}), StatusCode::FAILED_PRECONDITION,
               v1::ERROR_REASON_PROTOCOL, "before attach");
  expect_fault(raw_call("StreamSteps", {attach_bytes, attach_bytes}), StatusCode::FAILED_PRECONDITION,
               v1::ERROR_REASON_PROTOCOL, "second attach");
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(FaultTable, Row11_UnknownExpiredOrDeletedSession) {
  const auto not_found = [&](const char* id) {
    expect_fault(step(1, frame(1), nullptr, id), StatusCode::NOT_FOUND, v1::ERROR_REASON_SESSION_NOT_FOUND,
                 "create it again");
    expect_fault(raw_call("StreamSteps", {attach(id).SerializeAsString()}), StatusCode::NOT_FOUND,
                 v1::ERROR_REASON_SESSION_NOT_FOUND, "create it again");
  };
  not_found(kOther);
  ASSERT_TRUE(create().ok());
  {
    Context context;
    v1::DeleteSessionRequest request;
    request.set_session_id(kId);
    v1::DeleteSessionResponse deleted;
    ASSERT_TRUE(stub_->DeleteSession(&context, request, &deleted).ok());
  }
  not_found(kId);
  // Expiry needs a daemon of its own: there the untouched session would go too.
  const DaemonProcess hasty({"--idle-timeout", "100ms"});
  BareClient& client = *this;
  client.connect(hasty.socket());
  ASSERT_EQ(health_at_start(), 1);
  ASSERT_TRUE(create().ok());
  Context context;
  for (int i = 0; i < 500 && hasty.log().find("\"reason\":\"idle\"") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  not_found(kId);
  client.connect(daemon_->socket());
}

TEST_F(FaultTable, Row12_ASecondStreamOnASession) {
  ASSERT_TRUE(create().ok());
  Context first, third;
  const auto holder = open(first, 1);
  expect_fault(raw_call("StreamSteps", {attach(kId).SerializeAsString()}), StatusCode::ABORTED,
               v1::ERROR_REASON_SESSION_ATTACHED, "takeover");
  const auto taker = open(third, 1, kId, true);
  v1::StreamStepsResponse response;
  EXPECT_FALSE(holder->Read(&response));
  expect_fault(holder->Finish(), StatusCode::ABORTED, v1::ERROR_REASON_SESSION_ATTACHED, "taken over");
  ASSERT_TRUE(taker->Write(frame_message(1, frame(1))) && taker->Read(&response));
  EXPECT_EQ(hash_of(response.answer().contacts()), local_hashes(grids_, 0, 1).front());
}

}  // namespace
}  // namespace warmfront::test
