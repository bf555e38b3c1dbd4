// SPDX-License-Identifier: Apache-2.0
// Access control by tokens: sessions owned by their principal, the admin role, and a token file that is
// reloaded. Certificates: tls_test.cpp.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "server/auth/tokens.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/open_grids.h"
#include "tests/unit/server/three_tokens.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using client::Client;
using client::ClientOptions;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class TokenTest : public ::testing::Test {
 protected:
  static void write(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path) << text;
  }

  server::Config config() {
    write(folder_.path() / "tokens",
          std::string(kAliceToken) + " alice\n" + kBobToken + " bob\n" + kRootToken + " root admin\n");
    server::Config config;
    config.token_file = (folder_.path() / "tokens").string();
    return config;
  }
  Result<Client> connect(const std::string& token) { return connect(token, daemon_); }
  Result<Client> connect(const std::string& token, const LocalDaemon& daemon) {
    ClientOptions options;
    if (!token.empty()) {
      write(folder_.path() / "mine", token + "\n");
      options.security.token_file = (folder_.path() / "mine").string();
    }
    return Client::connect(daemon.address(), options);
  }

  const TemporaryFolder folder_;
  LocalDaemon daemon_{config()};
};

TEST_F(TokenTest, UnknownCallersAreRejected) {
  EXPECT_EQ(connect("").error().code, ErrorCode::kUnauthenticated);
  EXPECT_EQ(connect("wrong-0123456789abcdef").error().code, ErrorCode::kUnauthenticated);
  EXPECT_TRUE(connect(kAliceToken).ok());
  // A call without a token, or with a wrong one, is told how to send one.
  for (const char* token : {"", "wrong-0123456789abcdef"})
    EXPECT_THAT(connect(token).error().message, HasSubstr("\"authorization\", once, as \"Bearer TOKEN\""));
  // Every method requires it.
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::CollisionService::NewStub(channel);
  const auto context = [] {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    context->AddMetadata("authorization", "Basic 0123");
    return context;
  };
  const auto expect = [](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
  };
  v1::GetSessionResponse got;
  v1::ListSessionsResponse listed;
  v1::DeleteSessionResponse deleted;
  v1::StepResponse stepped;
  v1::CreateSessionResponse created;
  v1::StreamStepsResponse streamed;
  expect(stub->GetSession(context().get(), {}, &got));
  expect(stub->ListSessions(context().get(), {}, &listed));
  expect(stub->DeleteSession(context().get(), {}, &deleted));
  expect(stub->Step(context().get(), {}, &stepped));
  const auto create_context = context(), stream_context = context();
  expect(stub->CreateSession(create_context.get(), &created)->Finish());
  const auto stream = stub->StreamSteps(stream_context.get());
  EXPECT_FALSE(stream->Read(&streamed));
  expect(stream->Finish());
}

TEST_F(TokenTest, AnIdInUseByAnotherPrincipalLooksUnused) {
  Client alice = connect(kAliceToken).value(), bob = connect(kBobToken).value(),
         root = connect(kRootToken).value();
  client::Session hers = open_grids(alice).value();
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.AddMetadata("authorization", std::string("Bearer ") + kBobToken);
  v1::CreateSessionResponse created;
  const auto upload = stub->CreateSession(&context, &created);
  v1::CreateSessionRequest request;
  request.mutable_header()->set_session_id(hers.id());
  request.mutable_header()->set_vertex_count(3);
  request.mutable_header()->set_face_count(1);
  request.mutable_header()->set_dtype(v1::DTYPE_FLOAT64);
  const std::array<std::int32_t, 3> face{0, 1, 2};
  const std::array<double, 9> corners{0, 0, 0, 1, 0, 0, 0, 1, 0};
  upload->Write(request);
  request.set_faces(face.data(), sizeof(face));
  upload->Write(request);
  request.set_positions(corners.data(), sizeof(corners));
  upload->Write(request);
  upload->WritesDone();
  const grpc::Status status = upload->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message()
                           << ": the error reveals that another principal uses this id";
  EXPECT_EQ(bob.get_session(hers.id()).value().face_count, 1u);
  EXPECT_GT(alice.get_session(hers.id()).value().face_count, 1u);
  // A caller with the admin role selects the owner.
  const Status whose = root.delete_any_session(hers.id());
  ASSERT_FALSE(whose.ok());
  EXPECT_EQ(whose.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(whose.error().message, HasSubstr("alice and bob"));
  EXPECT_TRUE(root.delete_any_session(hers.id(), "bob").ok());
  EXPECT_TRUE(alice.get_session(hers.id()).ok());
  EXPECT_FALSE(bob.get_session(hers.id()).ok());
}

/// How a call ends whose only message is these bytes.
grpc::Status call_with_bytes(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                             const std::string& bytes) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  grpc::CompletionQueue queue;
  grpc::GenericStub stub(channel);
  const grpc::Slice slice(bytes);
  const auto call = stub.PrepareUnaryCall(&context, method, grpc::ByteBuffer(&slice, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

TEST_F(TokenTest, NothingIsParsedBeforeAuthentication) {
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  for (const char* method :
       {"CollisionService/CreateSession", "CollisionService/GetSession", "CollisionService/ListSessions",
        "CollisionService/DeleteSession", "CollisionService/ChangeScene", "CollisionService/CheckSession",
        "CollisionService/Step", "CollisionService/StreamSteps", "CollisionService/GetServerInfo",
        "AdminService/ListAllSessions", "AdminService/DeleteAnySession"})
    // Not a valid message of any type: the first parser reports it.
    EXPECT_EQ(
        call_with_bytes(channel, std::string("/warmfront.v1.") + method, "\x07 is no message").error_code(),
        grpc::StatusCode::UNAUTHENTICATED)
        << method;
}

TEST_F(TokenTest, SessionsBelongToTheirPrincipalAndSomeCallsNeedTheAdminRole) {
  Client alice = connect(kAliceToken).value(), bob = connect(kBobToken).value(),
         root = connect(kRootToken).value();
  client::Session session = open_grids(alice).value();
  EXPECT_EQ(alice.list_sessions().value().size(), 1u);
  EXPECT_TRUE(bob.list_sessions().value().empty());
  EXPECT_TRUE(root.list_sessions().value().empty())
      << "an administrator's own sessions are listed like any other";
  EXPECT_EQ(bob.get_session(session.id()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(bob.delete_session(session.id()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(bob.list_all_sessions().error().code, ErrorCode::kPermissionDenied);
  EXPECT_EQ(bob.delete_any_session(session.id()).error().code, ErrorCode::kPermissionDenied);
  const auto all = root.list_all_sessions();
  ASSERT_TRUE(all.ok()) << all.error().message;
  ASSERT_EQ(all.value().size(), 1u);
  EXPECT_EQ(all.value()[0].principal, "alice");
  const std::vector<double> next = MovingGrids(4).positions(1);
  EXPECT_TRUE(session.step(std::span<const double>(next)).ok());
  EXPECT_TRUE(root.delete_any_session(session.id()).ok());
  EXPECT_TRUE(alice.list_sessions().value().empty());
  EXPECT_THAT(daemon_.log(), HasSubstr("\"principal\":\"alice\""));
  for (const char* secret : {kAliceToken, kBobToken, kRootToken})
    EXPECT_THAT(daemon_.log(), Not(HasSubstr(secret)));
}

TEST_F(TokenTest, WhatAdministratorsDoIsRecorded) {
  const std::string file = (folder_.path() / "audit").string();
  daemon_.restart([&](server::Config& config) { config.audit_file = file; });
  Client alice = connect(kAliceToken).value(), root = connect(kRootToken).value();
  client::Session session = open_grids(alice).value();
  const std::string id = session.id();
  EXPECT_FALSE(alice.delete_any_session(id).ok());
  EXPECT_TRUE(root.list_all_sessions().ok());
  EXPECT_TRUE(root.delete_any_session(id).ok());
  EXPECT_FALSE(root.delete_any_session(id).ok());
  EXPECT_TRUE(daemon_->reload());
  std::ifstream written(file);
  std::vector<std::string> events;
  for (std::string line; std::getline(written, line);) {
    const nlohmann::json event = nlohmann::json::parse(line);
    EXPECT_EQ(event["event"], "audit");
    EXPECT_THAT(event["peer"].get<std::string>(), HasSubstr(event["action"] == "reload" ? "" : "unix:"));
    events.push_back(event["action"].get<std::string>() + " " + event["principal"].get<std::string>() + " " +
                     (event["session"] == id ? "it" : "-") + " " + event["owner"].get<std::string>() + " " +
                     std::to_string(event["code"].get<int>()));
  }
  EXPECT_EQ(events, (std::vector<std::string>{"DeleteAnySession alice it  7", "ListAllSessions root -  0",
                                              "DeleteAnySession root it alice 0",
                                              "DeleteAnySession root it  5", "reload signal -  0"}));
  EXPECT_THAT(daemon_.log(), HasSubstr("\"event\":\"audit\",\"action\":\"DeleteAnySession\""));
}

class PrincipalBytesTest : public TokenTest {
 protected:
  static server::Config small(server::Config config) {
    config.limits.max_principal_bytes = 300 << 10;
    return config;
  }
  LocalDaemon small_{small(config())};
};

TEST_F(PrincipalBytesTest, APrincipalAtItsByteQuotaDoesNotBlockOthers) {
  Client alice = connect(kAliceToken, small_).value(), bob = connect(kBobToken, small_).value();
  std::vector<client::Session> sessions;
  Result<client::Session> next = open_grids(alice);
  for (; next.ok() && sessions.size() < 100; next = open_grids(alice))
    sessions.push_back(std::move(next).value());
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.error().code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(next.error().message, HasSubstr("--max-principal-bytes"));
  EXPECT_THAT(
      small_.log(),
      ContainsRegex("\"event\":\"create_refused\",\"session\":\"[0-9a-f-]+\","
                    "\"principal\":\"alice\",\"code\":8,\"code_name\":\"RESOURCE_EXHAUSTED\",\"reason\":\""));
  EXPECT_GE(sessions.size(), 2u);
  EXPECT_TRUE(open_grids(bob).ok()) << "the daemon has room for others";
  const std::vector<double> moved = MovingGrids(4).positions(1);
  EXPECT_TRUE(sessions.front().step(std::span<const double>(moved)).ok()) << "what it has goes on";
}

TEST_F(TokenTest, AuthenticationComesFirstAlsoWhileDraining) {
  // A running upload keeps the daemon from ending.
  Client alice = connect(kAliceToken).value();
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::CollisionService::NewStub(channel);
  grpc::ClientContext upload_context;
  upload_context.AddMetadata("authorization", std::string("Bearer ") + kAliceToken);
  v1::CreateSessionResponse created;
  const auto upload = stub->CreateSession(&upload_context, &created);
  v1::CreateSessionRequest request;
  request.mutable_header()->set_session_id("01234567-89ab-cdef-0123-456789abcdef");
  request.mutable_header()->set_vertex_count(3);
  request.mutable_header()->set_face_count(1);
  request.mutable_header()->set_dtype(v1::DTYPE_FLOAT64);
  ASSERT_TRUE(upload->Write(request));
  // The daemon has the upload in hand before it drains: its headers came before those of calls that it
  // answered.
  for (int call = 0; call < 5; ++call) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", std::string("Bearer ") + kAliceToken);
    v1::GetServerInfoResponse info;
    ASSERT_TRUE(stub->GetServerInfo(&context, {}, &info).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::atomic<bool> enough{false};
  std::thread uploading([&] {
    request.set_faces("");
    while (!enough && upload->Write(request)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  std::thread draining([&] { daemon_->drain(); });
  Result<client::ServerInfo> info = alice.server_info();
  while (info.ok() && !info.value().draining) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    info = alice.server_info();
  }
  EXPECT_TRUE(info.ok()) << "it drained although an upload was in progress";

  const auto nobody = [] {
    auto context = std::make_unique<grpc::ClientContext>();
    context->AddMetadata("authorization", "Bearer nobody-0123456789abcdef");
    return context;
  };
  v1::ChangeSceneResponse changed;
  v1::StepResponse stepped;
  v1::CreateSessionResponse never;
  const auto create_context = nobody(), stream_context = nobody();
  for (const grpc::Status& status :
       {stub->ChangeScene(nobody().get(), {}, &changed), stub->Step(nobody().get(), {}, &stepped),
        stub->CreateSession(create_context.get(), &never)->Finish(),
        stub->StreamSteps(stream_context.get())->Finish()})
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
  enough = true;
  uploading.join();
  draining.join();
}

TEST_F(TokenTest, TheFileIsReloadedAndAnErrorInItChangesNothing) {
  Client alice = connect(kAliceToken).value();
  write(folder_.path() / "tokens", "short bob\n");
  EXPECT_FALSE(daemon_->reload());
  EXPECT_TRUE(alice.list_sessions().ok());
  write(folder_.path() / "tokens", std::string(kBobToken) + " bob\n");
  EXPECT_TRUE(daemon_->reload());
  EXPECT_EQ(alice.list_sessions().error().code, ErrorCode::kUnauthenticated);
  EXPECT_TRUE(connect(kBobToken).ok());
}

TEST_F(TokenTest, RevokingATokenEndsItsStreams) {
  Client alice = connect(kAliceToken).value(), bob = connect(kBobToken).value();
  client::Session hers = open_grids(alice).value(), his = open_grids(bob).value();
  const MovingGrids grids(4);
  const std::vector<double> first = grids.positions(1), second = grids.positions(2);
  ASSERT_TRUE(hers.step(std::span<const double>(first)).ok());
  ASSERT_TRUE(his.step(std::span<const double>(first)).ok());
  // The same token under another name gives no access to her sessions.
  write(folder_.path() / "tokens", std::string(kAliceToken) + " mallory\n" + kBobToken + " bob admin\n");
  ASSERT_TRUE(daemon_->reload());
  const auto refused = hers.step(std::span<const double>(second));
  ASSERT_FALSE(refused.ok()) << "the stream goes on with a token that is revoked";
  EXPECT_TRUE(his.step(std::span<const double>(second)).ok());
}

}  // namespace
}  // namespace warmfront::test
