// SPDX-License-Identifier: Apache-2.0
// Scenes that change between frames: limits hold however changes meet, and a frame that was answered is
// answered again after them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include "server/session/session.h"
#include "server/transport/convert.h"
#include "tests/support/observers.h"
#include "tests/support/scenes.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;
using server::Fault;
using ::testing::HasSubstr;

server::AddBody octahedron() {
  server::AddBody add;
  add.addition.body.vertex_count = 6;
  add.addition.faces = testing::octahedron();
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      for (int k = 0; k < 3; ++k) add.positions.push_back(k == axis ? sign : 0.0);
  return add;
}

/// A session of one octahedron, with limits on what may be added.
std::optional<Fault> change_twice(const server::Limits& limits) {
  server::Budget budget(1 << 30);
  server::Runner runner(2);
  const server::AddBody first = octahedron();
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
  session->change({1, {octahedron()}}, tell(one));
  session->change({1, {octahedron()}}, tell(other));
  EXPECT_FALSE(one.get_future().get().has_value()) << "there is room for one";
  std::optional<Fault> fault = other.get_future().get();
  EXPECT_EQ(session->scene()->vertex_count(), fault ? 12U : 18U);
  return fault;
}

/// A body is added and removed repeatedly, until the session refuses: how often it was added.
struct Churn {
  static constexpr int kThreads = 2;
  explicit Churn(std::size_t session_bytes, std::uint32_t window = server::Limits().window,
                 std::uint64_t max_vertices = server::Limits().max_vertices) {
    limits.window = window;
    limits.max_vertices = max_vertices;
    scene.vertex_count = 6;
    scene.faces = testing::octahedron();
    scene.bodies = {{"", 0, 6}};
    account = server::Account::open(budget, session_bytes, 0).value();
    server::PositionBuffer positions(server::Dtype::kFloat64, 6);
    EXPECT_TRUE(positions.append(bytes_of(octahedron().positions)).ok());
    session =
        server::Session::create(
            {server::SessionId::parse(kId).value(), scene, {}, server::Dtype::kFloat64, 0, {}}, positions,
            {std::make_shared<Workers>(1), runner, limits, account, [](server::Session&, const Fault&) {}})
            .value();
  }
  std::optional<Fault> change(server::SceneChange change) {
    std::promise<std::optional<Fault>> done;
    session->change({1, {std::move(change)}},
                    tell_change([&](const server::Outcome<server::SessionState>& outcome) {
                      done.set_value(outcome ? std::nullopt : std::optional(outcome.fault()));
                    }));
    return done.get_future().get();
  }
  std::optional<Fault> add(std::uint32_t octahedra) { return change(many(octahedra)); }
  std::optional<Fault> replace(std::uint32_t index, std::uint32_t octahedra) {
    server::AddBody with = many(octahedra);
    if (octahedra == 0) with.addition.body.kind = BodyKind::kRemoved;
    return change(server::ReplaceBody{index, std::move(with.addition), std::move(with.positions)});
  }
  static server::AddBody many(std::uint32_t octahedra) {
    server::AddBody body;
    for (std::uint32_t i = 0; i < octahedra; ++i) {
      server::AddBody one = octahedron();
      for (auto face : one.addition.faces) {
        for (auto& vertex : face) vertex += static_cast<std::int32_t>(6 * i);
        body.addition.faces.push_back(face);
      }
      for (std::size_t k = 0; k < one.positions.size(); ++k)
        body.positions.push_back(one.positions[k] + (k % 3 == 0 ? 10.0 * (i + 1) : 0));
    }
    body.addition.body.vertex_count = 6 * octahedra;
    return body;
  }
  std::optional<Fault> remove(std::uint32_t index) {
    server::ChangeBody removed{index, {}};
    removed.body.vertex_count = session->scene()->bodies()[index].vertex_count;
    removed.body.kind = BodyKind::kRemoved;
    return change(std::move(removed));
  }
  server::Limits limits;
  server::Budget budget{1 << 30};
  server::Runner runner{kThreads};
  SceneDescription scene;
  std::shared_ptr<server::Account> account;
  std::shared_ptr<server::Session> session;
};

TEST(SceneChangesTest, ASceneFullOfRemovedBodiesIsReported) {
  Churn churn(4 << 20);
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
  Churn churn(8 << 20);
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
  Churn limited(64 << 20, server::Limits().window, 1000);
  ASSERT_FALSE(limited.add(100));
  EXPECT_FALSE(limited.replace(1, 150)) << "906 vertices instead of 606";
  const std::optional<Fault> fault = limited.replace(1, 170);
  ASSERT_TRUE(fault);
  EXPECT_STREQ(fault->limit, "max-vertices");
  EXPECT_THAT(fault->message, HasSubstr("changes[0]: "));
  EXPECT_EQ(limited.session->scene()->vertex_count(), 906u);
}

TEST(SceneChangesTest, ABodyThatDoesNotFitIsRefusedBeforeAnythingIsBuilt) {
  Churn churn(4 << 20);
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

/// Two octahedra and patches for all three, as a client sends them.
v1::ChangeSceneRequest three_changes() {
  v1::ChangeSceneRequest request;
  request.set_session_id(kId);
  request.set_next_frame(1);
  request.set_key(std::string(36, 'k'));
  for (int i = 0; i < 2; ++i) {
    const server::AddBody add = octahedron();
    auto& message = *request.add_changes()->mutable_add();
    message.mutable_body()->set_vertex_count(6);
    message.mutable_body()->set_kind(v1::BODY_KIND_DEFORMABLE);
    message.mutable_body()->set_name(std::string(200, 'n'));
    message.set_faces(std::string(reinterpret_cast<const char*>(add.addition.faces.data()),
                                  12 * add.addition.faces.size()));
    message.set_positions(bytes_of(add.positions));
  }
  request.add_changes()->mutable_change_filters()->set_patches(std::string(4 * 18, '\1'));
  return request;
}

/// What the vectors and strings of an order hold.
std::size_t held_by(const server::ChangeOrder& order) {
  std::size_t bytes = order.key.capacity() + order.changes.capacity() * sizeof(server::SceneChange);
  for (const server::SceneChange& change : order.changes) {
    if (const auto* add = std::get_if<server::AddBody>(&change))
      bytes += add->addition.body.name.capacity() + 12 * add->addition.faces.capacity() +
               8 * add->positions.capacity();
    if (const auto* filters = std::get_if<server::ChangeFilters>(&change))
      bytes += 4 * filters->filters.patches.capacity();
  }
  return bytes;
}

/// What an order comes to that waits while the runner does other work, and what the account holds when its
/// client hears of it.
struct Reply {
  std::optional<ErrorCode> code;  ///< none: carried out
  std::size_t held;
};
Reply reply_to(
    Churn& churn, server::ChangeOrder order, const std::function<void()>& meanwhile = [] {}) {
  std::promise<void> go;
  const auto until_go = [ready = go.get_future().share()] { ready.wait(); };
  for (const server::Lane lane : {server::Lane::kShort, server::Lane::kLong})
    for (int i = 0; i < Churn::kThreads; ++i) churn.runner.post(until_go, lane);
  const std::size_t charged = churn.account->held();
  std::promise<Reply> reply;
  std::atomic<bool> told{false};
  churn.session->change(
      std::move(order), tell_change([&](const server::Outcome<server::SessionState>& outcome) {
        told = true;
        reply.set_value(
            {outcome ? std::nullopt : std::optional(outcome.fault().code), churn.account->held()});
      }));
  if (!told) {
    EXPECT_EQ(churn.account->held(), charged) << "what waits is charged";
  }
  meanwhile();
  go.set_value();
  return reply.get_future().get();
}

class WaitingChangesTest : public ::testing::Test {
 protected:
  server::ChangeOrder order() {
    auto made = server::change_order_from(three_changes(), server::Dtype::kFloat64, {}, churn_.account);
    EXPECT_TRUE(made.ok());
    EXPECT_GT(churn_.account->held(), before_);
    return std::move(made).value();
  }
  Churn churn_{4 << 20};
  const std::size_t before_ = churn_.account->held();
};

TEST_F(WaitingChangesTest, AreChargedBeforeTheyAreMade) {
  const server::ChangeOrder made = order();
  EXPECT_GE(churn_.account->held(), before_ + held_by(made));
  EXPECT_LE(churn_.account->held(), before_ + 2 * held_by(made));
  v1::ChangeSceneRequest large = three_changes();
  large.mutable_changes(2)->mutable_change_filters()->set_patches(std::string(4 << 20, '\1'));
  const std::size_t charged = churn_.account->held();
  const auto refused = server::change_order_from(large, server::Dtype::kFloat64, {}, churn_.account);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.fault().code, ErrorCode::kResourceExhausted);
  EXPECT_STREQ(refused.fault().limit, "max-session-bytes");
  EXPECT_THAT(refused.fault().message, HasSubstr("changes: 4.0 MiB while they wait for their turn: "));
  EXPECT_THAT(refused.fault().message, HasSubstr("raise --max-session-bytes"));
  EXPECT_EQ(churn_.account->held(), charged);
}

TEST_F(WaitingChangesTest, AreChargedUntilTheyAreCarriedOut) {
  EXPECT_EQ(reply_to(churn_, order()).code, std::nullopt);
  churn_.session.reset();
  while (churn_.account.use_count() > 1) std::this_thread::yield();  // its job ends after the reply
  EXPECT_EQ(churn_.account->held(), 0U);
}

TEST_F(WaitingChangesTest, AreChargedUntilTheyAreRefused) {
  server::ChangeOrder out_of_order = order();
  out_of_order.next_frame = 7;
  const Reply reply = reply_to(churn_, std::move(out_of_order));
  EXPECT_EQ(reply.code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(reply.held, before_);
}

TEST_F(WaitingChangesTest, AreChargedUntilTheyAreGivenUp) {
  server::ChangeOrder given_up = order();
  given_up.given_up = std::make_shared<std::atomic<bool>>(false);
  const Reply reply =
      reply_to(churn_, std::move(given_up), [flag = given_up.given_up] { flag->store(true); });
  EXPECT_EQ(reply.code, ErrorCode::kCancelled);
  EXPECT_EQ(reply.held, before_);
}

TEST_F(WaitingChangesTest, AreChargedUntilTheSessionIsClosed) {
  const Reply reply = reply_to(churn_, order(), [this] { churn_.session->close_as("was deleted"); });
  EXPECT_EQ(reply.code, ErrorCode::kNotFound);
  EXPECT_EQ(reply.held, before_);
}

TEST_F(WaitingChangesTest, AreNotChargedWhereTooManyWait) {
  Churn full(4 << 20, 0);
  const std::size_t before = full.account->held();
  auto made = server::change_order_from(three_changes(), server::Dtype::kFloat64, {}, full.account);
  ASSERT_TRUE(made.ok());
  const Reply reply = reply_to(full, std::move(made).value());
  EXPECT_EQ(reply.code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(reply.held, before);
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
    const server::AddBody add = octahedron();
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
  ASSERT_TRUE(step(2, frame(2) + bytes_of(octahedron().positions)).ok());
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
