// SPDX-License-Identifier: Apache-2.0
// Half-spaces behind a daemon: the same answers as in this process, at any pose and in any description,
// also after restarts; they are part of a session's state, and invalid ones are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "client/lib/any_session.h"
#include "proto/wire/scene.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using client::AnySession;
using client::Client;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

Body plane(BodyKind kind, double height) {
  Body body{"plane", 0, 0, kind};
  body.half_space = HalfSpace{{0, 0, height}, {0, 0.1, 3}};
  return body;
}

Pose shift(double z) {
  Pose pose;
  pose.matrix[11] = z;
  return pose;
}

TEST(RemoteHalfSpacesTest, AnswersAsInThisProcessAndAfterRestarts) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  const std::vector<double> start = grids.positions(0);
  SceneDescription scene = grids.scene();
  scene.bodies = {plane(BodyKind::kRigid, 0), {"grids", 0, scene.vertex_count}};
  const ColliderOptions options{.fields = {.weights = true, .normal = true, .points = true}};
  AnySession here = AnySession::create(scene, Doubles(start), options).value();
  client::Session there = client.create_session(scene, Doubles(start), options).value();
  std::uint64_t frame = 0;
  std::uint64_t contacts = 0;
  const auto same = [&](const std::vector<BodyPose>& poses) {
    daemon.restart();
    const std::vector<double> positions = grids.positions(++frame);
    const std::array<BodyPositions, 1> bodies{{{1, Doubles(positions)}}};
    Frame next;
    if (poses.empty()) {
      next = Frame(Doubles(positions));
    } else {
      next.bodies = bodies;
      next.poses = poses;
    }
    const auto a = here.step(next), b = there.step(next);
    ASSERT_TRUE(a.ok()) << a.error().message;
    ASSERT_TRUE(b.ok()) << b.error().message;
    EXPECT_EQ(a.value().contacts, b.value().contacts);
    EXPECT_EQ(a.value().vh, b.value().vh);
    contacts += b.value().vh;
    const auto near = there.proximity(0.05);
    ASSERT_TRUE(near.ok()) << near.error().message;
    EXPECT_EQ(here.proximity(0.05).value().contacts, near.value().contacts);
    EXPECT_EQ(here.vertex_distances(0.5).value().vertex_distances,
              there.vertex_distances(0.5).value().vertex_distances);
  };
  same({{0, shift(0.1)}});
  same({});
  same({{0, shift(-0.2)}});
  const auto both = [&](auto&& change) {
    ASSERT_TRUE(change(here).ok());
    ASSERT_TRUE(change(there).ok());
  };
  // Part of a trial, and other descriptions.
  const std::vector<BodyPose> up{{0, shift(0.7)}};
  Frame rising;
  rising.poses = up;
  both([&](auto& session) { return session.trial(rising); });
  const auto a = here.commit(0.25), b = there.commit(0.25);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a.value().vh, b.value().vh);
  same({});
  both([](auto& session) { return session.change_body(0, plane(BodyKind::kRigid, 0.05)); });
  same({});
  both([](auto& session) { return session.change_body(0, plane(BodyKind::kStatic, 0)); });
  same({});
  both([](auto& session) { return session.add_body({plane(BodyKind::kRigid, -0.5), {}}, Doubles()); });
  same({{2, shift(0.4)}});
  same({});
  Body gone{"", 0, 0, BodyKind::kRemoved};
  both([&](auto& session) { return session.change_body(0, gone); });
  same({});
  EXPECT_GT(contacts, 100U);
  const auto refused = there.add_body({plane(BodyKind::kDeformable, 0), {}}, Doubles());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("kind: is deformable"));
}

TEST(RemoteHalfSpacesTest, ABodyIsWhatItsMessageSays) {
  const Body body = plane(BodyKind::kRigid, 0.25);
  EXPECT_EQ(wire::body_from(wire::to_proto(body), "body").value(), body);
  v1::Body message = wire::to_proto(body);
  message.mutable_half_space()->add_normal(1);
  EXPECT_THAT(wire::body_from(message, "bodies[3]").error().message,
              HasSubstr("bodies[3].half_space.normal: has 4 numbers; give 3"));
  message.mutable_half_space()->clear_point();
  EXPECT_THAT(wire::body_from(message, "bodies[3]").error().message, HasSubstr("point: has 0 numbers"));
}

class ServiceHalfSpacesTest : public ServiceTest {};

// Two sessions that differ in a half-space alone are in other states.
TEST_F(ServiceHalfSpacesTest, ArePartOfASessionsState) {
  std::vector<std::uint64_t> digests;
  for (const double height : {-5.0, -6.0}) {
    v1::SessionHeader said = header_with_bodies(kId);
    Body body = plane(BodyKind::kStatic, height);
    body.first_vertex = said.vertex_count();
    *said.add_bodies() = wire::to_proto(body);
    v1::CreateSessionResponse response;
    ASSERT_TRUE(create(said, faces(), frame(0), {}, &response).ok());
    digests.push_back(response.session().state().digest());
    v1::DeleteSessionRequest gone;
    gone.set_session_id(kId);
    v1::DeleteSessionResponse ignored;
    Context context;
    ASSERT_TRUE(stub_->DeleteSession(&context, gone, &ignored).ok());
  }
  EXPECT_NE(digests[0], digests[1]);
}

}  // namespace
}  // namespace warmfront::test
