// SPDX-License-Identifier: Apache-2.0
// Edges of no face behind a daemon: the same answers as in this process, also when the daemon dies; an
// upload is what its header announces, and edges are part of a session's state and count within its limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "client/lib/any_session.h"
#include "proto/wire/chunked_array.h"
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
using Edges = std::vector<std::array<std::int32_t, 2>>;

/// Two grids as two bodies, and chords across each.
SceneDescription with_chords(const MovingGrids& grids) {
  SceneDescription scene = grids.scene();
  const std::uint32_t half = grids.vertex_count() / 2;
  scene.bodies = {{"", 0, half}, {"", half, half}};
  for (std::uint32_t v = 0; v + 9 < half; v += 5)
    for (const std::uint32_t first : {0U, half})
      scene.edges.push_back({static_cast<std::int32_t>(first + v), static_cast<std::int32_t>(first + v + 9)});
  return scene;
}

TEST(RemoteEdgesTest, AnswersAsInThisProcessAndAfterRestarts) {
  LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(6);
  const std::vector<double> start = grids.positions(0);
  const SceneDescription scene = with_chords(grids);
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
    const auto near = there.proximity(0.05), tangled = there.intersections();
    ASSERT_TRUE(near.ok()) << near.error().message;
    ASSERT_TRUE(tangled.ok()) << tangled.error().message;
    EXPECT_EQ(here.proximity(0.05).value().contacts, near.value().contacts);
    EXPECT_EQ(here.intersections().value().contacts, tangled.value().contacts);
  };
  same();
  // A strand through the middle of the grids.
  more = {0, 0, -1, 0.01, 0.02, 0, 0, 0, 1};
  const BodyAddition strand{{"", 0, 3}, {}, {{0, 1}, {1, 2}}};
  ASSERT_TRUE(here.add_body(strand, Doubles(more)).ok());
  ASSERT_TRUE(there.add_body(strand, Doubles(more)).ok());
  same();
  same();
  EXPECT_EQ(there.resumes(), 3U);
  EXPECT_GT(contacts, 0U);
  const auto info = client.get_session(there.id()).value();
  const Result<Scene> made = Scene::create(scene);
  EXPECT_EQ(info.lone_edge_count, made.value().lone_edges().size() + 2);
  EXPECT_EQ(info.edge_count, made.value().edge_count() + 2);
  const auto refused = there.add_body({{"", 0, 3}, {}, {{0, 1}, {2, 2}}}, Doubles(more));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("edges[1]: joins vertex 2 to itself"));
  same();
}

TEST(RemoteEdgesTest, AnUploadIsWhatItsHeaderAnnounces) {
  server::Limits limits;
  v1::CreateSessionRequest head, positions;
  v1::SessionHeader& header = *head.mutable_header();
  header.set_session_id(kId);
  header.set_vertex_count(3);
  header.set_edge_count(3);
  header.set_dtype(v1::DTYPE_FLOAT32);
  positions.set_positions(std::string(36, '\0'));
  const Edges edges{{0, 1}, {1, 2}, {2, 0}};
  std::vector<v1::CreateSessionRequest> pieces;
  const auto keep = [&](const v1::CreateSessionRequest& piece) {
    pieces.push_back(piece);
    return true;
  };
  wire::send_chunks(wire::as_bytes(edges), 7, keep,
                    [](v1::CreateSessionRequest& to, std::string piece) { to.set_edges(std::move(piece)); });
  ASSERT_EQ(pieces.size(), 4U);
  const auto outcome = [&](const std::vector<v1::CreateSessionRequest>& requests) -> std::string {
    server::Upload upload(limits);
    for (const v1::CreateSessionRequest& request : requests)
      if (auto fault = upload.add(request)) return fault->message;
    if (auto fault = upload.complete()) return fault->message;
    EXPECT_EQ(upload.estimate_bytes(), server::estimate_bytes(3, 3, 4, false, false, limits));
    return upload.take_spec().scene.edges == edges ? "accepted" : "other edges";
  };
  EXPECT_EQ(outcome({head, pieces[0], pieces[1], positions, pieces[2], pieces[3]}), "accepted");
  EXPECT_THAT(outcome({head, positions, pieces[0], pieces[1]}),
              HasSubstr("edges: the upload ended after 14 of 24 bytes"));
  EXPECT_THAT(outcome({head, pieces[0], pieces[1], pieces[2], pieces[3], pieces[3]}),
              HasSubstr("edges: 27 bytes, but 24 are announced"));
  limits.max_triangles = 2;
  EXPECT_THAT(outcome({head}), HasSubstr("face_count and edge_count"));
  limits.max_triangles = 3;
  EXPECT_THAT(outcome({head, positions, pieces[0]}), HasSubstr("edges: the upload ended after 7 of 24 bytes"));
  head.mutable_header()->set_edge_count(0);
  EXPECT_THAT(outcome({head, pieces[0]}), HasSubstr("edges: 7 bytes, but 0 are announced"));
}

class ServiceEdgesTest : public ServiceTest {};

// Two sessions that differ in an edge alone are in other states: a client goes on with its own only.
TEST_F(ServiceEdgesTest, ArePartOfASessionsState) {
  std::vector<std::uint64_t> digests;
  for (const Edges& edges : {Edges{}, Edges{{0, 2}}, Edges{{0, 3}}}) {
    v1::SessionHeader said = header_with_bodies(kId);
    said.set_edge_count(static_cast<std::uint32_t>(edges.size()));
    std::vector<v1::CreateSessionRequest> more;
    if (!edges.empty()) more.emplace_back().set_edges(std::string(wire::as_bytes(edges)));
    v1::CreateSessionResponse response;
    ASSERT_TRUE(create(said, faces(), frame(0), more, &response).ok());
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
