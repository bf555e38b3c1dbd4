// SPDX-License-Identifier: Apache-2.0
// A session that moves to another daemon and back: each daemon may hold an outdated copy, and only a copy in
// the session's own state may answer. Every answer is compared with a collider in this process.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "client/lib/client.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/bare_client.h"
#include "tests/unit/server/http_get.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/switchboard.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using Doubles = std::span<const double>;

/// Waits until it holds, half a minute at most.
template <class Condition>
bool eventually(Condition holds) {
  for (int i = 0; i < 3000; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

/// Two grids as two bodies, which are tested against each other or not.
SceneDescription two_bodies(const MovingGrids& grids, bool meet) {
  SceneDescription scene = grids.scene();
  for (const std::uint32_t first : {0U, grids.vertex_count() / 2}) {
    Body body{"", first, grids.vertex_count() / 2};
    if (!meet && first > 0) body.mask = 2;
    scene.bodies.push_back(body);
  }
  return scene;
}

BodyAddition addition_of(std::uint32_t vertices, const std::vector<std::array<std::int32_t, 3>>& faces) {
  BodyAddition addition;
  addition.body.vertex_count = vertices;
  addition.faces = faces;
  return addition;
}

/// A collider in this process that is told what the session is told.
class Expected {
 public:
  Expected(const SceneDescription& scene, const std::vector<double>& start)
      : collider_(Collider::create(std::make_shared<const Scene>(Scene::create(scene).value()),
                                   Doubles(start), {}, std::make_shared<Workers>(1))
                      .value()) {}
  Collider& operator*() { return collider_; }
  std::uint64_t step(const std::vector<double>& positions) {
    const StepResult step = collider_.step(Doubles(positions)).value();
    ContactHash hash;
    hash.add_step(collider_.scene(), step.contacts);
    contacts_ = step.contacts.size();
    return hash.value();
  }
  std::size_t contacts() const { return contacts_; }

 private:
  Collider collider_;
  std::size_t contacts_ = 0;
};

class TwoDaemons : public ::testing::Test {
 protected:
  static server::Config few_contacts() {
    server::Config config;
    config.limits.max_contacts = 40;
    return config;
  }
  Session open(const SceneDescription& scene) {
    const std::vector<double> start = grids_.positions(0);
    auto session = client_.create_session(scene, Doubles(start));
    EXPECT_TRUE(session.ok()) << session.error().message;
    return std::move(session).value();
  }
  static void expect_step(Session& session, Expected& expected, const std::vector<double>& positions) {
    const Result<Answer> answer = session.step(Doubles(positions));
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(hash_of(answer.value()), expected.step(positions))
        << answer.value().contacts.size() << " contacts instead of " << expected.contacts();
  }
  /// A and B, reached without the switchboard.
  client::SessionInfo at(LocalDaemon& daemon, const std::string& id) {
    return Client::connect(daemon.address()).value().get_session(id).value();
  }

  const MovingGrids grids_{6};
  LocalDaemon a_;
  LocalDaemon b_{few_contacts()};
  Switchboard board_{a_.address()};
  Client client_ = Client::connect(board_.address()).value();
};

TEST_F(TwoDaemons, AStaleCopyIsNotAcceptedAsTheSession) {
  const std::vector<double> still = grids_.positions(0);
  Session session = open(two_bodies(grids_, false));
  Expected expected(two_bodies(grids_, false), grids_.positions(0));
  expect_step(session, expected, still);
  // A is unreachable for a while; the session continues at B, and is changed there.
  board_.lead_to(b_.address());
  Body body{"", 0, grids_.vertex_count() / 2};
  ASSERT_TRUE(session.change_body(1, body).ok());
  ASSERT_TRUE((*expected).change_body(1, body).ok());
  // B dies, and A is reachable again; the next frame is the one that A expects.
  board_.lead_to(a_.address());
  b_.stop();
  expect_step(session, expected, grids_.positions(1));
  EXPECT_GT(expected.contacts(), 0U);
  EXPECT_EQ(session.resumes(), 2U);
}

TEST_F(TwoDaemons, ACopyThatComputedAFrameWhichTheOtherRefusedIsNotTakenForTheSession) {
  Session session = open(grids_.scene());
  Expected expected(grids_.scene(), grids_.positions(0));
  std::vector<double> near_start = grids_.positions(0);
  for (double& x : near_start) x += 1e-3;
  expect_step(session, expected, near_start);
  // A computes frame 2, and its answer is lost.
  board_.lose_answers();
  const std::vector<double> through = grids_.positions(1);
  ASSERT_EQ(session.submit(Doubles(through)).value(), 2U);
  ASSERT_TRUE(eventually([&] { return at(a_, session.id()).last_frame == 2; }));
  // B refuses it, and the caller sends another frame 2.
  board_.lead_to(b_.address());
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kResourceExhausted);
  expect_step(session, expected, grids_.positions(0));
  // B dies, and A expects frame 3.
  board_.lead_to(a_.address());
  b_.stop();
  expect_step(session, expected, near_start);
  EXPECT_EQ(expected.contacts(), 0U);
  expect_step(session, expected, through);
  EXPECT_GT(expected.contacts(), 40U);
}

// The same frame number and the same answer so far, but B saw other positions.
TEST_F(TwoDaemons, AnAnswerThatWasLostIsOnlyTakenForTheSameFrame) {
  Session session = open(grids_.scene());
  Expected expected(grids_.scene(), grids_.positions(0));
  board_.lose_answers();
  const std::vector<double> first = grids_.positions(1);
  ASSERT_TRUE(session.submit(Doubles(first)).ok());
  ASSERT_TRUE(eventually([&] { return at(a_, session.id()).last_frame == 1; }));
  board_.lead_to(a_.address());
  const Result<Answer> again = session.next_answer();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(hash_of(again.value()), expected.step(first));
  EXPECT_EQ(at(a_, session.id()).steps, 1U) << "answered from memory: the copy was the session's own";
  // Another client steps the copy at A: it no longer expects frame 2, or answered another one.
  BareClient thief;
  thief.connect(a_.address());
  ASSERT_TRUE(thief.step(2, bytes_of(grids_.positions(6)), nullptr, session.id()).ok());
  expect_step(session, expected, grids_.positions(2));
  EXPECT_GT(expected.contacts(), 0U);
  EXPECT_EQ(session.resumes(), 2U);
}

TEST_F(TwoDaemons, AChangeWhoseAnswerIsLostIsDoneOnce) {
  Session session = open(two_bodies(grids_, true));
  Expected expected(two_bodies(grids_, true), grids_.positions(0));
  expect_step(session, expected, grids_.positions(1));
  board_.lose_answers();
  const MovingGrids added(3);
  const BodyAddition addition = addition_of(added.vertex_count(), added.scene().faces);
  const std::vector<double> where = added.positions(0);
  auto index = std::async(std::launch::async, [&] { return session.add_body(addition, Doubles(where)); });
  ASSERT_TRUE(eventually([&] { return at(a_, session.id()).body_count == 3; }));
  board_.lead_to(a_.address());
  const Result<std::uint32_t> result = index.get();
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result.value(), 2U);
  ASSERT_TRUE((*expected).add_body(addition, Doubles(where)).ok());
  EXPECT_EQ(at(a_, session.id()).body_count, 3U);
  EXPECT_EQ(at(a_, session.id()).steps, 1U) << "it is still the copy that carried the change out";
  std::vector<double> positions = grids_.positions(2);
  positions.insert(positions.end(), where.begin(), where.end());
  expect_step(session, expected, positions);
  EXPECT_EQ(session.resumes(), 1U);
}

// The limit is met for as long as others fill it: a resume waits, within its timeout.
TEST_F(TwoDaemons, AResumeWaitsForRoom) {
  server::Config config;
  config.limits.max_sessions = 1;
  config.metrics_listen = "127.0.0.1:0";
  LocalDaemon full(config);
  BareClient other;
  other.connect(full.address());
  ASSERT_TRUE(other.create().ok());
  Session session = open(grids_.scene());
  Expected expected(grids_.scene(), grids_.positions(0));
  expect_step(session, expected, grids_.positions(1));
  board_.lead_to(full.address());
  const std::vector<double> positions = grids_.positions(2);
  auto answer = std::async(std::launch::async, [&] { return session.step(Doubles(positions)); });
  const auto refused = [&] {
    return get(full->metrics_port(), "/metrics").find("{reason=\"max-sessions\"} 0\n") == std::string::npos;
  };
  EXPECT_TRUE(eventually(refused));
  ASSERT_TRUE(Client::connect(full.address()).value().delete_session(kId).ok());
  const Result<Answer> second = answer.get();
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(hash_of(second.value()), expected.step(positions));
}

// Creating a session does not wait for room: without room it fails at once, and leaves nothing in the
// daemon.
TEST_F(TwoDaemons, ASessionThatFindsNoRoomAtFirstIsRefusedAtOnce) {
  server::Config config;
  config.limits.max_open_streams = 1;
  LocalDaemon full(config);
  Client client = Client::connect(full.address()).value();
  const std::vector<double> start = grids_.positions(0);
  const Session first = client.create_session(grids_.scene(), Doubles(start)).value();
  const auto second = client.create_session(grids_.scene(), Doubles(start));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(client.list_sessions().value().size(), 1U);
}

// A living daemon merely refuses it.
TEST_F(TwoDaemons, AWrongChangeWhileTheDaemonIsAwayIsRefused) {
  Session session = open(two_bodies(grids_, true));
  Expected expected(two_bodies(grids_, true), grids_.positions(0));
  expect_step(session, expected, grids_.positions(1));
  board_.lead_to(b_.address());
  const std::vector<double> where(9, 0.0);
  const BodyAddition wrong = addition_of(3, {{0, 1, 77}});
  EXPECT_EQ(session.add_body(wrong, Doubles(where)).error().code, ErrorCode::kInvalidArgument);
  board_.lead_to(a_.address());
  EXPECT_EQ(session.add_body(wrong, Doubles(where)).error().code, ErrorCode::kInvalidArgument);
  expect_step(session, expected, grids_.positions(2));
}

}  // namespace
}  // namespace warmfront::test
