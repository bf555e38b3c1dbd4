// SPDX-License-Identifier: Apache-2.0
// A current client and a daemon too old for session states: its copy cannot be verified, so it is never
// reused; the session is created again, and the answers are right. And a daemon too old for an option of a
// question, which it would ignore.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>

#include "client/lib/client.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/switchboard.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using Doubles = std::span<const double>;

/// What a daemon does not know, and what came before it neither.
enum class Unknown { kStates, kQuestions };

/// Forwards each call to a current daemon, and removes from requests and answers what an older one does not
/// know.
class OlderService final : public v1::CollisionService::Service {
 public:
  explicit OlderService(const std::string& address, Unknown unknown = Unknown::kStates)
      : states_(unknown != Unknown::kStates),
        stub_(
            v1::CollisionService::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {
  }

  grpc::Status GetServerInfo(grpc::ServerContext* call, const v1::GetServerInfoRequest* request,
                             v1::GetServerInfoResponse* response) override {
    const grpc::Status status = stub_->GetServerInfo(own(call).get(), *request, response);
    response->clear_features();
    return status;
  }
  grpc::Status DeleteSession(grpc::ServerContext* call, const v1::DeleteSessionRequest* request,
                             v1::DeleteSessionResponse* response) override {
    return stub_->DeleteSession(own(call).get(), *request, response);
  }
  grpc::Status ChangeScene(grpc::ServerContext* call, const v1::ChangeSceneRequest* request,
                           v1::ChangeSceneResponse* response) override {
    v1::ChangeSceneRequest older = *request;
    older.clear_key();
    older.clear_expected_state();
    const grpc::Status status = stub_->ChangeScene(own(call).get(), older, response);
    response->clear_state();
    response->mutable_session()->clear_state();
    return status;
  }
  grpc::Status CreateSession(grpc::ServerContext* call, grpc::ServerReader<v1::CreateSessionRequest>* upload,
                             v1::CreateSessionResponse* response) override {
    const auto context = own(call);
    const auto writer = stub_->CreateSession(context.get(), response);
    for (v1::CreateSessionRequest part; upload->Read(&part);) writer->Write(part);
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    if (!states_) response->mutable_session()->clear_state();
    return status;
  }
  grpc::Status StreamSteps(
      grpc::ServerContext* call,
      grpc::ServerReaderWriter<v1::StreamStepsResponse, v1::StreamStepsRequest>* stream) override {
    const auto context = own(call);
    const auto onwards = stub_->StreamSteps(context.get());
    std::thread requests([&] {
      for (v1::StreamStepsRequest request; stream->Read(&request);) {
        if (request.step().has_question()) {
          request.mutable_step()->mutable_question()->clear_reduced();
          request.mutable_step()->mutable_question()->clear_keep_distance();
        }
        onwards->Write(request);
      }
      context->TryCancel();
    });
    for (v1::StreamStepsResponse response; onwards->Read(&response);) {
      if (states_) {
      } else if (response.has_attached()) {
        response.mutable_attached()->clear_state();
        response.mutable_attached()->clear_state_before();
      } else if (response.has_answer() && response.answer().has_summary()) {
        response.mutable_answer()->mutable_summary()->clear_state();
        response.mutable_answer()->mutable_summary()->clear_state_before();
      }
      stream->Write(response);
    }
    const grpc::Status status = onwards->Finish();
    call->TryCancel();  // so that the thread that reads ends
    requests.join();
    return status;
  }

 private:
  static std::unique_ptr<grpc::ClientContext> own(grpc::ServerContext* call) {
    return grpc::ClientContext::FromServerContext(*call);
  }
  const bool states_;
  const std::unique_ptr<v1::CollisionService::Stub> stub_;
};

/// Listens for a service, as long as it lives.
struct Serving {
  explicit Serving(grpc::Service& service) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    builder.RegisterService(&service);
    server = builder.BuildAndStart();
  }
  ~Serving() { server->Shutdown(std::chrono::system_clock::now()); }
  Serving(const Serving&) = delete;
  Serving& operator=(const Serving&) = delete;

  const TemporaryFolder folder;
  const std::string address = "unix:" + (folder.path() / "older.sock").string();
  std::unique_ptr<grpc::Server> server;
};

TEST(OlderDaemon, IsNotTrustedWithACopyButServes) {
  LocalDaemon daemon;
  OlderService service(daemon.address());
  const Serving older(service);
  Switchboard board(older.address);
  {
    const MovingGrids grids(5);
    SceneDescription scene = grids.scene();
    for (const std::uint32_t first : {0U, grids.vertex_count() / 2})
      scene.bodies.push_back({"", first, grids.vertex_count() / 2});
    const auto expected = local_hashes(grids, 0, 4);
    const std::vector<double> start = grids.positions(0);
    Client client = Client::connect(board.address()).value();
    Client direct = Client::connect(daemon.address()).value();
    Session session = client.create_session(scene, Doubles(start)).value();
    const auto step = [&](std::uint64_t frame) {
      const std::vector<double> positions = grids.positions(frame);
      const Result<Answer> answer = session.step(Doubles(positions));
      ASSERT_TRUE(answer.ok()) << answer.error().message;
      EXPECT_EQ(hash_of(answer.value()), expected[frame - 1]);
    };
    step(1);
    step(2);
    EXPECT_EQ(session.resumes(), 0u) << "a copy that was just created is not created again";
    board.lead_to(older.address);
    step(3);
    EXPECT_EQ(session.resumes(), 1u);
    EXPECT_EQ(direct.get_session(session.id()).value().steps, 1u) << "made again, at frame 2";
    ASSERT_TRUE(session.change_body(1, scene.bodies[1]).ok());
    step(4);
    EXPECT_EQ(session.resumes(), 1u);
    // What it does not know is not asked of it.
    const Status filtered = session.change_filters({.within_edges = 1});
    EXPECT_EQ(filtered.error().code, ErrorCode::kUnimplemented) << filtered.error().message;
    EXPECT_EQ(session.change_options({}).error().code, ErrorCode::kUnimplemented);
    EXPECT_EQ(session.change_excluded_pairs({{0, 1}}).error().code, ErrorCode::kUnimplemented);
    Body thick = scene.bodies[1];
    thick.thickness = 0.1;
    EXPECT_EQ(session.change_body(1, thick).error().code, ErrorCode::kUnimplemented);
    const std::vector<double> corners{9, 9, 9, 10, 9, 9, 9, 10, 9};
    BodyAddition addition{{"", 0, 3}, {{0, 1, 2}}};
    addition.body.thickness = 0.1;
    EXPECT_EQ(session.add_body(addition, Doubles(corners)).error().code, ErrorCode::kUnimplemented);
    EXPECT_EQ(session.add_body({{"", 0, 3}, {}, {{0, 1}}}, Doubles(corners)).error().code,
              ErrorCode::kUnimplemented);
    SceneDescription with_edges = scene;
    with_edges.edges = {{0, 1}};
    SceneDescription filtered_scene = scene, thick_scene = scene, of_vertices = scene;
    filtered_scene.filters.within_edges = 1;
    thick_scene.bodies[1] = thick;
    of_vertices.thickness.assign(grids.vertex_count(), 0.1);
    for (const SceneDescription& one : {filtered_scene, thick_scene, of_vertices, with_edges}) {
      const auto refused = client.create_session(one, Doubles(start));
      ASSERT_FALSE(refused.ok());
      EXPECT_EQ(refused.error().code, ErrorCode::kUnimplemented) << refused.error().message;
    }
    EXPECT_EQ(direct.list_sessions().value().size(), 1u) << "nothing is left of it";
  }
}

TEST(OlderDaemon, ThatIgnoresReducedIsDetectedByItsAnswer) {
  LocalDaemon daemon;
  OlderService service(daemon.address(), Unknown::kQuestions);
  const Serving older(service);
  {
    const MovingGrids grids(5);
    const std::vector<double> start = grids.positions(0);
    Client client = Client::connect(older.address).value();
    Session session = client.create_session(grids.scene(), Doubles(start)).value();
    const auto all = session.proximity(0.5);
    ASSERT_TRUE(all.ok() && all.value().contacts.size() > 0);
    const auto reduced = session.proximity(0.5, Where::kBase, {.reduced = true});
    ASSERT_FALSE(reduced.ok());
    EXPECT_EQ(reduced.error().code, ErrorCode::kUnimplemented) << reduced.error().message;
    EXPECT_TRUE(session.proximity(1e-9, Where::kBase, {.reduced = true}).ok())
        << "nothing is near, nothing to reduce";
    const auto after = session.proximity(0.5);
    ASSERT_TRUE(after.ok()) << "the session goes on";
    EXPECT_EQ(after.value().contacts, all.value().contacts);
  }
}

TEST(OlderDaemon, ThatIgnoresKeepDistanceIsDetectedByItsAnswer) {
  LocalDaemon daemon;
  OlderService service(daemon.address(), Unknown::kQuestions);
  const Serving older(service);
  {
    const MovingGrids grids(5);
    const std::vector<double> start = grids.positions(0), end = grids.positions(1);
    for (const std::string& address : {daemon.address(), older.address}) {
      Client client = Client::connect(address).value();
      Session session = client.create_session(grids.scene(), Doubles(start)).value();
      const bool knows = address == daemon.address();
      EXPECT_TRUE(session.max_step(Doubles(end)).ok());
      const auto kept = session.max_step(Doubles(end), false, {.keep_distance = 0.5});
      ASSERT_EQ(kept.ok(), knows);
      if (!knows) {
        EXPECT_EQ(kept.error().code, ErrorCode::kUnimplemented) << kept.error().message;
      }
      EXPECT_TRUE(session.step(Doubles(end)).ok()) << "the session goes on";
    }
  }
}

}  // namespace
}  // namespace warmfront::test
