// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 18 and 19: unauthenticated callers, callers without permission, and calls that time out.
#include <sys/stat.h>

#include <chrono>
#include <fstream>

#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;

TEST_F(FaultTable, Row18_NoTokenABadOneOrAnothersSession) {
  const std::string alice = "alice-0123456789abcdef0123456789", bob = "bob-0123456789abcdef0123456789ab";
  const TemporaryFolder folder;
  const std::string path = folder.path() / "tokens";
  std::ofstream(path) << alice << " alice\n" << bob << " bob\n";
  chmod(path.c_str(), 0600);
  const DaemonProcess guarded({"--token-file", path});
  connect(guarded.socket());
  const auto get = [&](const std::string& token) {
    Context context;
    context.set_wait_for_ready(true);
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    v1::GetSessionRequest request;
    request.set_session_id(kId);
    v1::GetSessionResponse response;
    return stub_->GetSession(&context, request, &response);
  };
  // alice's session.
  Context context;
  context.set_wait_for_ready(true);
  context.AddMetadata("authorization", "Bearer " + alice);
  v1::CreateSessionResponse created;
  const auto upload = stub_->CreateSession(&context, &created);
  v1::CreateSessionRequest part;
  *part.mutable_header() = header();
  upload->Write(part);
  part.set_faces(faces());
  upload->Write(part);
  part.set_positions(frame(0));
  upload->Write(part);
  upload->WritesDone();
  const grpc::Status uploaded = upload->Finish();
  ASSERT_TRUE(uploaded.ok()) << uploaded.error_message();

  EXPECT_TRUE(get(alice).ok());
  const grpc::Status others = get(bob);
  EXPECT_EQ(others.error_code(), StatusCode::NOT_FOUND) << "nor is it revealed that the session exists";
  for (const std::string& token :
       {std::string(), alice.substr(1), alice + "x", std::string("x"), std::string(8000, 'y')})
    EXPECT_EQ(get(token).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(create(kOther).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(step(1, frame(1)).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(raw_call("StreamSteps", {attach(kId, true).SerializeAsString()}).error_code(),
            StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(guarded.log().find("0123456789abcdef"), std::string::npos) << "no token is in the log";
  connect(daemon_->socket());
}

TEST_F(FaultTable, Row19_TheDeadlinePassesInTheMiddleOfAStep) {
  allowed_peak_ = 128 * kMiB;
  allowed_growth_ = 64 * kMiB;
  // All faces through all faces: minutes of work, far beyond the deadline of the call that waits for its
  // end.
  constexpr int kTriangles = 20000;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<double> apart, together, still;
  for (int i = 0; i < kTriangles; ++i) {
    faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    for (int corner = 0; corner < 3; ++corner) {
      const double x = corner == 1 ? 1.0 : 0.0, y = corner == 2 ? 1.0 : 0.0;
      apart.insert(apart.end(), {x, y, 10.0 * i});
      together.insert(together.end(), {x, y, -1e-3 * i});
      still.insert(still.end(), {x, y, 10.0 * i + 1});
    }
  }
  v1::SessionHeader wanted = header();
  wanted.set_vertex_count(3 * kTriangles);
  wanted.set_face_count(kTriangles);
  ASSERT_TRUE(
      create(wanted, {reinterpret_cast<const char*>(faces.data()), faces.size() * 12}, bytes_of(apart)).ok());
  for (int i = 0; i < 3; ++i) {
    grpc::ClientContext hurried;
    hurried.set_deadline(std::chrono::system_clock::now() + 100ms);
    v1::StepRequest request;
    request.set_session_id(kId);
    request.set_frame(1);
    request.set_positions(bytes_of(together));
    v1::StepResponse ignored;
    EXPECT_EQ(stub_->Step(&hurried, request, &ignored).error_code(), StatusCode::DEADLINE_EXCEEDED);
  }
  // The caller is gone, so the work was stopped, and the frame was not counted.
  v1::StepResponse response;
  const auto began = std::chrono::steady_clock::now();
  const grpc::Status status = step(1, bytes_of(still), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.summary().rows(), 0U);
  std::printf("the session was free %lld ms later\n",
              static_cast<long long>((std::chrono::steady_clock::now() - began) / 1ms));
}

}  // namespace
}  // namespace warmfront::test
