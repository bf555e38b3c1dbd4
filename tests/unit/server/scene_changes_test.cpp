// SPDX-License-Identifier: Apache-2.0
// Scenes that change between frames: limits hold however changes meet, and a frame that was answered is
// answered again after them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "server/session/session.h"
#include "server/transport/convert.h"
#include "tests/support/observers.h"
#include "tests/unit/server/scene_churn.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using server::Fault;
using ::testing::HasSubstr;

/// A session of one octahedron, with limits on what may be added.
std::optional<Fault> change_twice(const server::Limits& limits) {
  server::Budget budget(1 << 30);
  server::Runner runner(2);
  const server::AddBody first = octahedron_to_add();
  SceneDescription scene;
  scene.vertex_count = 6;
  scene.faces = first.addition.faces;
  scene.bodies = {{"", 0, 6}};
  server::PositionBuffer positions(server::Dtype::kFloat64, 6);
  EXPECT_TRUE(positions.append(bytes_of(first.positions)).ok());
  const auto session =
      server::Session::create(
          {server::SessionId::parse(kId).value(), scene, {}, server::Dtype::kFloat64, 0, {}}, positions,
          {std::make_shared<Workers>(1), runner, limits, server::Account::open(budget, 1 << 30, 0).value(),
           [](server::Session&, const Fault&) {}})
          .value();
  std::promise<std::optional<Fault>> one, other;
  const auto tell = [](auto& promise) {
    return tell_change([&promise](const server::Outcome<server::SessionState>& outcome) {
      promise.set_value(outcome ? std::nullopt : std::optional(outcome.fault()));
    });
  };
  session->change({1, {octahedron_to_add()}}, tell(one));
  session->change({1, {octahedron_to_add()}}, tell(other));
  EXPECT_FALSE(one.get_future().get().has_value()) << "there is room for one";
  std::optional<Fault> fault = other.get_future().get();
  EXPECT_EQ(session->scene()->vertex_count(), fault ? 12U : 18U);
  return fault;
}

TEST(SceneChangesTest, ASceneFullOfRemovedBodiesIsReported) {
  SceneChurn churn(4 << 20);
  std::optional<Fault> fault;
  std::uint32_t bodies = 1;
  for (; bodies < 100; ++bodies) {
    fault = churn.add(100);
    if (fault) break;
    fault = churn.remove(bodies);
    ASSERT_FALSE(fault) << fault->message;
  }
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(fault->limit, "max-session-bytes");
  EXPECT_FALSE(fault->retry_after) << "waiting does not help";
  const std::string removed = std::to_string(600 * (bodies - 1));
  EXPECT_THAT(fault->message,
              HasSubstr("; " + removed + " of its " + std::to_string(600 * (bodies - 1) + 6)));
  EXPECT_THAT(fault->message, HasSubstr(std::to_string(bodies - 1) + " removed bodies"));
  EXPECT_THAT(fault->message, HasSubstr("creating the session again"));
  EXPECT_GE(bodies, 3u);
}

// What churning fills, replacing does not: room of what went is used again, and given back.
TEST(SceneChangesTest, ABodyThatIsReplacedTakesTheRoomOfTheOneBefore) {
  SceneChurn churn(8 << 20);
  ASSERT_FALSE(churn.add(100));
  ASSERT_FALSE(churn.replace(1, 90));
  const std::size_t held = churn.account->held();
  for (std::uint32_t i = 0; i < 200; ++i) {
    const std::optional<Fault> fault = churn.replace(1, i % 2 == 0 ? 100 : 90);
    ASSERT_FALSE(fault) << fault->message;
  }
  EXPECT_EQ(churn.session->scene()->vertex_count(), 6u + 540u);
  EXPECT_LE(churn.account->held(), held + held / 20);
  ASSERT_FALSE(churn.replace(1, 0));
  EXPECT_EQ(churn.session->scene()->vertex_count(), 6u);
  EXPECT_LT(churn.account->held(), held / 2);
  EXPECT_FALSE(churn.replace(1, 100)) << "its index waits for another body";
}

// The scene that would be there counts, not what is there beside it meanwhile.
TEST(SceneChangesTest, AReplacementIsLimitedByTheSceneThatItLeaves) {
  SceneChurn limited(64 << 20, server::Limits().window, 1000);
  ASSERT_FALSE(limited.add(100));
  EXPECT_FALSE(limited.replace(1, 150)) << "906 vertices instead of 606";
  const std::optional<Fault> fault = limited.replace(1, 170);
  ASSERT_TRUE(fault);
  EXPECT_STREQ(fault->limit, "max-vertices");
  EXPECT_THAT(fault->message, HasSubstr("changes[0]: "));
  EXPECT_EQ(limited.session->scene()->vertex_count(), 906u);
}

TEST(SceneChangesTest, ABodyThatDoesNotFitIsRefusedBeforeAnythingIsBuilt) {
  SceneChurn churn(4 << 20);
  const std::size_t before = churn.account->held();
  const std::optional<Fault> fault = churn.add(1000);  // some 8 MiB
  ASSERT_TRUE(fault);
  EXPECT_STREQ(fault->limit, "max-session-bytes");
  EXPECT_THAT(fault->message, HasSubstr("would hold some"));
  EXPECT_THAT(fault->message, ::testing::Not(HasSubstr("removed")));
  EXPECT_EQ(churn.session->scene()->vertex_count(), 6u);
  EXPECT_LE(churn.account->held(), before + 4096) << "nothing has grown";
  EXPECT_FALSE(churn.add(10)) << "the session goes on";
}

TEST(SceneChangesTest, ConcurrentChangesDoNotExceedALimitTogether) {
  server::Limits limits;
  EXPECT_FALSE(change_twice(limits).has_value());
  limits.max_vertices = 17;
  std::optional<Fault> fault = change_twice(limits);
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(fault->limit, "max-vertices");
  EXPECT_THAT(fault->message, HasSubstr("changes[0]: vertices of the scene: 18"));
  limits = {};
  limits.max_triangles = 23;
  fault = change_twice(limits);
  ASSERT_TRUE(fault.has_value());
  EXPECT_STREQ(fault->limit, "max-triangles");
}

class ChangedSceneTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_vertices = 72 + 12;  // two octahedra beside the grids
    return config;
  }
  ChangedSceneTest() : ServiceTest(config()) {}

  grpc::Status create_with_bodies() {
    v1::SessionHeader wanted = header_with_bodies();
    for (v1::Body& body : *wanted.mutable_bodies()) body.set_kind(v1::BODY_KIND_DEFORMABLE);
    return create(wanted, faces(), frame(0));
  }
  grpc::Status add_bodies(std::uint64_t next_frame, int count) {
    const server::AddBody add = octahedron_to_add();
    v1::ChangeSceneRequest request;
    request.set_session_id(kId);
    request.set_next_frame(next_frame);
    for (int i = 0; i < count; ++i) {
      auto& message = *request.add_changes()->mutable_add();
      message.mutable_body()->set_vertex_count(6);
      message.mutable_body()->set_kind(v1::BODY_KIND_DEFORMABLE);
      message.set_faces(std::string(reinterpret_cast<const char*>(add.addition.faces.data()),
                                    12 * add.addition.faces.size()));
      message.set_positions(bytes_of(add.positions));
    }
    Context context;
    v1::ChangeSceneResponse response;
    return stub_->ChangeScene(&context, request, &response);
  }
};

TEST_F(ChangedSceneTest, AChangeWithoutADescriptionIsRefused) {
  ASSERT_TRUE(create_with_bodies().ok());
  v1::ChangeSceneRequest request;
  request.set_session_id(kId);
  request.set_next_frame(1);
  request.add_changes()->mutable_change()->set_index(0);
  Context context;
  v1::ChangeSceneResponse response;
  const grpc::Status refused = stub_->ChangeScene(&context, request, &response);
  EXPECT_EQ(refused.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("changes[0].change.body: is missing"));
}

TEST_F(ChangedSceneTest, AFrameAnsweredBeforeIsAnsweredAgain) {
  ASSERT_TRUE(create_with_bodies().ok());
  v1::StepResponse first, again;
  ASSERT_TRUE(step(1, frame(1), &first).ok());
  ASSERT_GT(first.summary().rows(), 0U);
  ASSERT_TRUE(add_bodies(2, 1).ok());
  const grpc::Status repeated = step(1, frame(1), &again);
  ASSERT_TRUE(repeated.ok()) << repeated.error_message();
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  const grpc::Status longer = step(1, frame(1) + frame(1));
  EXPECT_EQ(longer.error_code(), StatusCode::ABORTED) << "more than was answered is another frame";
  const grpc::Status short_of_a_body = step(2, frame(2));
  EXPECT_EQ(short_of_a_body.error_code(), StatusCode::INVALID_ARGUMENT);
  ASSERT_TRUE(step(2, frame(2) + bytes_of(octahedron_to_add().positions)).ok());
}

TEST_F(ChangedSceneTest, TooManyBodiesAreRefusedTogether) {
  ASSERT_TRUE(create_with_bodies().ok());
  EXPECT_EQ(add_bodies(1, 3).error_code(), StatusCode::RESOURCE_EXHAUSTED);
  Context context;
  v1::GetSessionRequest request;
  request.set_session_id(kId);
  v1::GetSessionResponse response;
  ASSERT_TRUE(stub_->GetSession(&context, request, &response).ok());
  EXPECT_EQ(response.session().vertex_count(), grids_.vertex_count()) << "none was added";
  EXPECT_TRUE(add_bodies(1, 2).ok());
}

class FullSessionTest : public ServiceTest {
 protected:
  static server::Config config() {
    server::Config config;
    config.limits.max_session_bytes = 1 << 20;
    return config;
  }
  FullSessionTest() : ServiceTest(config()) {}
};

// Many new descriptions of bodies add nothing to the scene, but wait in memory.
TEST_F(FullSessionTest, ChangesBeyondWhatASessionMayHoldAreRefusedBeforeTheyWait) {
  ASSERT_TRUE(create(header_with_bodies(), faces(), frame(0)).ok());
  v1::ChangeSceneRequest request;
  request.set_session_id(kId);
  request.set_next_frame(1);
  const auto change = [&](int count) {
    request.clear_changes();
    for (int i = 0; i < count; ++i) {
      v1::BodyChange& renamed = *request.add_changes()->mutable_change();
      renamed.mutable_body()->set_kind(v1::BODY_KIND_DEFORMABLE);
      renamed.mutable_body()->set_name(std::string(200, 'n'));
    }
    Context context;
    v1::ChangeSceneResponse response;
    return stub_->ChangeScene(&context, request, &response);
  };
  const grpc::Status refused = change(5000);
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED) << refused.error_message();
  EXPECT_EQ(detail_of(refused).limit(), "max-session-bytes");
  EXPECT_THAT(refused.error_message(), HasSubstr("while they wait for their turn"));
  EXPECT_TRUE(change(100).ok());
}

}  // namespace
}  // namespace warmfront::test
