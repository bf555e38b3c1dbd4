// SPDX-License-Identifier: Apache-2.0
// A client that gives up while its session waits to be built: nothing is left of it.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <latch>
#include <thread>

#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

class CreateCancelTest : public ServiceTest {
 protected:
  v1::GetServerInfoResponse info() {
    Context context;
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info;
  }
  /// Until the daemon holds nothing for sessions; false when it does for long.
  bool holds_nothing() {
    for (int i = 0; i < 500; ++i) {
      const v1::GetServerInfoResponse now = info();
      if (now.sessions() == 0 && now.charged_bytes() == 0) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
};

TEST_F(CreateCancelTest, LeavesNothingThoughItsTurnHasNotCome) {
  // Both threads of the daemon for short work are busy.
  std::latch taken(2), go(1), gone(2);
  for (int i = 0; i < 2; ++i)
    daemon_->when_runner_moves([&] {
      taken.count_down();
      go.wait();
      gone.count_down();
    });
  taken.wait();
  {
    Context context;
    v1::CreateSessionResponse response;
    const auto upload = stub_->CreateSession(&context, &response);
    v1::CreateSessionRequest request;
    *request.mutable_header() = header();
    upload->Write(request);
    request.set_faces(faces());
    upload->Write(request);
    request.set_positions(frame(0));
    upload->Write(request);
    upload->WritesDone();
    // The upload is complete, and the session waits to be built.
    for (int i = 0; i < 500 && info().sessions() == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(info().sessions(), 1U);
    context.TryCancel();
    EXPECT_EQ(upload->Finish().error_code(), StatusCode::CANCELLED);
  }
  EXPECT_TRUE(holds_nothing()) << "its memory is free at once";
  go.count_down();
  gone.wait();
  expect_healthy();
  EXPECT_TRUE(holds_nothing()) << "and it was not built afterwards";
  EXPECT_EQ(daemon_.log().find("\"event\":\"session_created\",\"session\":\"" + std::string(kId)),
            std::string::npos);
}

}  // namespace
}  // namespace warmfront::test
