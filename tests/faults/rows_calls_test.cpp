// SPDX-License-Identifier: Apache-2.0
// Fault table, row 18: callers who are nobody, or somebody else.
#include <sys/stat.h>

#include <fstream>

#include "tests/faults/fault_table.h"

namespace warmfront::test {
namespace {

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
  EXPECT_EQ(others.error_code(), StatusCode::NOT_FOUND) << "that it exists is not told either";
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

}  // namespace
}  // namespace warmfront::test
