// SPDX-License-Identifier: Apache-2.0
// Thick vertices and bodies behind a daemon: the same answers as in this process, also after a restart of
// the daemon; what is wrong is refused with the field and the index, and changes nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "client/lib/any_session.h"
#include "proto/wire/scene.h"
#include "server/transport/upload.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using client::AnySession;
using client::Client;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

/// Two grids, as two bodies.
SceneDescription two_bodies(const MovingGrids& grids) {
  SceneDescription scene = grids.scene();
  const std::uint32_t half = grids.vertex_count() / 2;
  scene.bodies = {{"", 0, half}, {"", half, half}};
  return scene;
}

TEST(RemoteThicknessTest, AnswersAsInThisProcessAndAfterRestarts) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  const std::uint32_t n = grids.vertex_count();
  const std::vector<double> start = grids.positions(0);
  for (const bool of_vertices : {false, true}) {
    SceneDescription scene = two_bodies(grids);
    scene.bodies[0].thickness = 0.1;
    for (std::uint32_t v = 0; of_vertices && v < n; ++v) scene.thickness.push_back(0.01 * (v % 5));
    AnySession here = AnySession::create(scene, Doubles(start), {}).value();
    client::Session there = client.create_session(scene, Doubles(start)).value();
    std::uint64_t frame = 0;
    std::uint64_t contacts = 0;
    std::vector<double> more;
    const auto same = [&] {
      daemon.restart();
      std::vector<double> positions = grids.positions(++frame);
      positions.insert(positions.end(), more.begin(), more.end());
      const auto a = here.step(Frame(Doubles(positions))), b = there.step(Frame(Doubles(positions)));
      ASSERT_TRUE(a.ok()) << a.error().message;
      ASSERT_TRUE(b.ok()) << b.error().message;
      EXPECT_EQ(a.value().contacts, b.value().contacts);
      contacts += a.value().contacts.size();
      const auto near = there.proximity(0.05);
      ASSERT_TRUE(near.ok()) << near.error().message;
      EXPECT_EQ(here.proximity(0.05).value().contacts, near.value().contacts);
    };
    same();
    // Right above a vertex of the first grid: that it is thick alone makes contacts.
    more = {0, 0, 0.3, 0.1, 0, 0.3, 0, 0.1, 0.3};
    BodyAddition addition{{"", 0, 3}, {{0, 1, 2}}};
    addition.body.thickness = 0.5;
    ASSERT_TRUE(here.add_body(addition, Doubles(more)).ok());
    ASSERT_TRUE(there.add_body(addition, Doubles(more)).ok());
    same();
    Body thinner = scene.bodies[0];
    thinner.thickness = 0.02;
    ASSERT_TRUE(here.change_body(0, thinner).ok());
    ASSERT_TRUE(there.change_body(0, thinner).ok());
    same();
    EXPECT_EQ(there.resumes(), 3u);
    EXPECT_EQ(client.get_session(there.id()).value().most_thickness, of_vertices ? 0.5 + 0.04 : 0.5);
    EXPECT_GT(contacts, 0u);
    Body wrong = thinner;
    wrong.thickness = -1;
    const Status refused = there.change_body(0, wrong);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(refused.error().message, HasSubstr("thickness: is -1"));
    same();
  }
}

// Changes a session of a scene of two grids, whose daemon is lost then. A daemon tells of no thickness where
// there is none, and is not too old for it.
template <class Change>
void expect_made_again_after(const MovingGrids& grids, const SceneDescription& scene, Change&& change) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const std::vector<double> start = grids.positions(0), next = grids.positions(1);
  client::Session session = client.create_session(scene, Doubles(start)).value();
  const Status changed = change(session, Doubles(start));
  ASSERT_TRUE(changed.ok()) << changed.error().message;
  daemon.restart();
  const auto answer = session.step(Frame(Doubles(next)));
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  EXPECT_EQ(session.resumes(), 1u);
}

TEST(RemoteThicknessTest, WhereNothingIsThickOrNotAnyMoreTheSessionIsMadeAgain) {
  const MovingGrids grids(6);
  SceneDescription scene = two_bodies(grids);
  scene.bodies[0].thickness = 0.1;
  scene.thickness.assign(grids.vertex_count(), 0.0);
  expect_made_again_after(grids, scene, [&](client::Session& session, Doubles /*start*/) {
    Body removed = scene.bodies[0];
    removed.kind = BodyKind::kRemoved;
    return session.change_body(0, removed);
  });
}

// The client kept that there is some, of vertices that it no longer knew of.
TEST(RemoteThicknessTest, WhereWhatWasThickMadeWayTheSessionIsMadeAgain) {
  const MovingGrids grids(6);
  SceneDescription scene = two_bodies(grids);
  const std::uint32_t half = grids.vertex_count() / 2;
  scene.thickness.assign(grids.vertex_count(), 0.0);
  scene.thickness[half] = 0.1;
  expect_made_again_after(grids, scene, [&](client::Session& session, Doubles start) {
    const BodyAddition thin{{"", 0, half}, {{0, 1, 6}}, {}, std::vector<double>(half, 0.0)};
    return session.replace_body(1, thin, start.subspan(std::size_t{3} * half));
  });
}

TEST(RemoteThicknessTest, WhatIsWrongAtTheStartHasTheSameCode) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  const std::vector<double> start = grids.positions(0);
  const auto expect_refused = [&](const SceneDescription& scene, const ColliderOptions& options) {
    const auto here = AnySession::create(scene, Doubles(start), options);
    const auto there = client.create_session(scene, Doubles(start), options);
    ASSERT_FALSE(here.ok());
    ASSERT_FALSE(there.ok());
    EXPECT_EQ(here.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(there.error().code, ErrorCode::kInvalidArgument) << there.error().message;
    EXPECT_THAT(there.error().message, HasSubstr("thickness"));
  };
  SceneDescription scene = two_bodies(grids);
  scene.bodies[1].thickness = std::numeric_limits<double>::quiet_NaN();
  expect_refused(scene, {});
  scene.bodies[1].thickness = 0.1;
  expect_refused(scene, {.tier = Tier::kFast});
  scene.bodies[1].thickness = 0;
  scene.thickness.assign(grids.vertex_count(), 0.1);
  scene.thickness[7] = -0.1;
  expect_refused(scene, {});
  EXPECT_TRUE(client.list_sessions().value().empty());
}

TEST(RemoteThicknessTest, AnUploadIsWhatItsHeaderAnnounces) {
  const server::Limits limits;
  v1::CreateSessionRequest head, faces, positions, thickness;
  v1::SessionHeader& header = *head.mutable_header();
  header.set_session_id(kId);
  header.set_vertex_count(3);
  header.set_face_count(1);
  header.set_dtype(v1::DTYPE_FLOAT32);
  header.set_vertex_thickness(true);
  faces.set_faces(std::string(12, '\0'));
  positions.set_positions(std::string(36, '\0'));
  const std::vector<double> lengths{0.25, 0, 1};
  std::vector<v1::CreateSessionRequest> pieces;
  wire::upload_thickness(lengths, 7, [&](const v1::CreateSessionRequest& piece) {
    pieces.push_back(piece);
    return true;
  });
  ASSERT_EQ(pieces.size(), 4u);
  const auto outcome = [&](std::vector<v1::CreateSessionRequest> requests) -> std::string {
    server::Upload upload(limits);
    for (const v1::CreateSessionRequest& request : requests)
      if (auto fault = upload.add(request)) return fault->message;
    if (auto fault = upload.complete()) return fault->message;
    const std::size_t thick = upload.estimate_bytes();
    EXPECT_GT(thick, server::estimate_bytes(3, 1, 4, false, false, limits));
    return upload.take_spec().scene.thickness == lengths ? "accepted" : "another thickness";
  };
  EXPECT_EQ(outcome({head, faces, pieces[0], pieces[1], positions, pieces[2], pieces[3]}), "accepted");
  EXPECT_THAT(outcome({head, faces, positions, pieces[0], pieces[1]}),
              HasSubstr("thickness: the upload ended after 14 of 24 bytes"));
  EXPECT_THAT(outcome({head, pieces[0], pieces[1], pieces[2], pieces[3], pieces[3]}),
              HasSubstr("thickness: 27 bytes, but 24 are announced"));
  head.mutable_header()->set_vertex_thickness(false);
  EXPECT_THAT(outcome({head, pieces[0]}), HasSubstr("thickness: 7 bytes, but 0 are announced"));
}

class ServiceThicknessTest : public ServiceTest {};

// Two sessions that differ in a thickness alone are in other states: a client goes on with its own only.
TEST_F(ServiceThicknessTest, IsPartOfASessionsState) {
  std::vector<std::uint64_t> digests;
  for (const double of_vertices : {0.0, 0.1, 0.2}) {
    v1::SessionHeader said = header_with_bodies(kId);
    said.mutable_bodies(0)->set_thickness(0.1);
    std::vector<v1::CreateSessionRequest> more;
    if (of_vertices > 0) {
      said.set_vertex_thickness(true);
      wire::upload_thickness(std::vector<double>(said.vertex_count(), of_vertices), 1000,
                             [&](const v1::CreateSessionRequest& piece) {
                               more.push_back(piece);
                               return true;
                             });
    }
    v1::CreateSessionResponse response;
    ASSERT_TRUE(create(said, faces(), frame(0), more, &response).ok());
    EXPECT_EQ(response.session().most_thickness(), 0.1 + of_vertices);
    digests.push_back(response.session().state().digest());
    v1::DeleteSessionRequest gone;
    gone.set_session_id(kId);
    v1::DeleteSessionResponse ignored;
    Context context;
    ASSERT_TRUE(stub_->DeleteSession(&context, gone, &ignored).ok());
  }
  EXPECT_NE(digests[0], digests[1]);
  EXPECT_NE(digests[1], digests[2]);
}

}  // namespace
}  // namespace warmfront::test
