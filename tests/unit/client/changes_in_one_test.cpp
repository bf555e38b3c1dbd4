// SPDX-License-Identifier: Apache-2.0
// Several changes of a scene in one request: what they make one after the other, all of them or none, in this
// process and behind a daemon, also when the session is lost afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "client/lib/any_session.h"
#include "client/lib/client.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

/// Two squares of two triangles, the second at this height over the first.
template <class Number>
std::vector<Number> squares(Number height) {
  return {0,
          0,
          0,
          1,
          0,
          0,
          0,
          1,
          0,
          1,
          1,
          0,
          Number(0.25),
          Number(0.25),
          height,
          Number(1.25),
          Number(0.25),
          height,
          Number(0.25),
          Number(1.25),
          height,
          Number(1.25),
          Number(1.25),
          height};
}

const std::vector<std::array<std::int32_t, 3>> kSquare{{0, 1, 2}, {1, 3, 2}};

SceneDescription description() {
  SceneDescription scene;
  scene.vertex_count = 8;
  scene.faces = {{0, 1, 2}, {1, 3, 2}, {4, 5, 6}, {5, 7, 6}};
  scene.bodies = {{"", 0, 4}, {"", 4, 4}};
  return scene;
}

/// A torn square, another mesh above, a third body, which changes and then is in no pair with the first.
std::vector<SceneChange> changes() {
  BodyAddition larger{{"", 0, 5}, {{0, 1, 2}, {1, 3, 4}}, {{0, 4}}};
  BodyAddition third{{"", 0, 4, BodyKind::kRigid}, kSquare};
  return {ReplaceElements{0, {{0, 1, 2}}, {{1, 3}}},
          AddBody{third, {0, 0, 2, 1, 0, 2, 0, 1, 2, 1, 1, 2}},
          ReplaceBody{1, larger, {0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, 2, 2, 1}},
          ChangeFilters{{.excluded_vertex_pairs = {{0, 12}}}},
          ChangeFilters{{}},
          ChangeBody{2, {"", 0, 0, BodyKind::kDeformable}},
          ChangeExcludedPairs{{{0, 2}}}};
}

Status one_by_one(AnySession& session) {
  for (SceneChange& change : changes())
    if (Status changed = session.change({std::move(change)}); !changed) return changed;
  return session.change_options({.min_separation = 0.125});
}

class ChangesInOneTest : public ::testing::Test {
 protected:
  template <class Number>
  std::vector<AnySession> open() {
    const std::vector<Number> start = squares<Number>(1);
    std::vector<AnySession> both;
    both.push_back(AnySession::create(description(), std::span<const Number>(start), {}).value());
    both.emplace_back(client_.create_session(description(), std::span<const Number>(start), {}).value());
    return both;
  }
  /// What the scene's last body meets as it falls.
  template <class Number>
  static Answer fall(AnySession& session) {
    const std::vector<Number> below{0, 0, Number(-0.5), 1, 0, Number(-0.5),
                                    0, 1, Number(-0.5), 1, 1, Number(-0.5)};
    const BodyPositions body{2, std::span<const Number>(below)};
    Frame frame;
    frame.bodies = {&body, 1};
    return session.step(frame).value();
  }
  template <class Number>
  void expect_the_same() {
    std::vector<AnySession> in_turn = open<Number>(), in_one = open<Number>();
    for (AnySession& session : in_turn) ASSERT_TRUE(one_by_one(session).ok());
    for (AnySession& session : in_one) {
      const Status changed = session.change(changes(), ColliderOptions{.min_separation = 0.125});
      ASSERT_TRUE(changed.ok()) << changed.error().message;
    }
    const Answer expected = fall<Number>(in_turn[0]);
    EXPECT_GT(expected.contacts.size(), 0U);
    EXPECT_EQ(fall<Number>(in_turn[1]).contacts, expected.contacts);
    EXPECT_EQ(fall<Number>(in_one[0]).contacts, expected.contacts);
    // The daemon forgets the session, which is made again from what the client knows.
    const std::vector<SessionInfo> sessions = client_.list_sessions().value();
    for (const SessionInfo& session : sessions)
      ASSERT_TRUE(client_.delete_session(session.id).ok());
    EXPECT_EQ(fall<Number>(in_one[1]).contacts, expected.contacts);
  }

  test::LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
};

TEST_F(ChangesInOneTest, AreThoseOneAfterTheOtherInFloat64) {
  expect_the_same<double>();
}

TEST_F(ChangesInOneTest, AreThoseOneAfterTheOtherInFloat32) {
  expect_the_same<float>();
}

TEST_F(ChangesInOneTest, AreAllCarriedOutOrNone) {
  for (AnySession& session : open<double>()) {
    SCOPED_TRACE(session.is_remote());
    std::vector<SceneChange> wrong = changes();
    wrong[2] = ReplaceElements{1, {{0, 1, 9}}};
    EXPECT_THAT(session.change(std::move(wrong)).error().message,
                AllOf(HasSubstr("changes[2]: "), HasSubstr("vertex index 9")));
    EXPECT_THAT(session.change({ReplaceElements{7, {}}}).error().message,
                HasSubstr("changes[0]: index: body 7"));
    EXPECT_THAT(session.change(changes(), ColliderOptions{.leaf_size = 4}).error().message,
                HasSubstr("options.leaf_size"));
    EXPECT_TRUE(session.change({}).ok());
    const std::vector<double> down = squares<double>(-1);
    EXPECT_GT(session.step(Frame(std::span<const double>(down))).value().contacts.size(), 0U)
        << "both squares are as they were";
    EXPECT_TRUE(session.change({}, ColliderOptions{.report = Report::kCount}).ok());
    EXPECT_TRUE(session.change(changes()).ok());
  }
}

TEST_F(ChangesInOneTest, NumbersThatFloat32DoesNotHoldAreRefused) {
  for (AnySession& session : open<float>()) {
    std::vector<SceneChange> exact = changes();
    std::get<AddBody>(exact[1]).positions[4] = 0.1;
    const Status changed = session.change(std::move(exact));
    ASSERT_FALSE(changed.ok()) << session.is_remote();
    EXPECT_THAT(changed.error().message, HasSubstr("changes[1]: positions[1]: 0.100000 is no float32"));
  }
}

}  // namespace
}  // namespace warmfront::client
