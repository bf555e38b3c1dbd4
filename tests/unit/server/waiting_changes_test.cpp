// SPDX-License-Identifier: Apache-2.0
// Changes of a scene that wait for their turn are charged for as long as they wait.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include "server/session/session.h"
#include "server/transport/convert.h"
#include "tests/support/observers.h"
#include "tests/unit/server/scene_churn.h"
#include "tests/unit/server/service_fixture.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;

/// Two octahedra and patches for all three, as a client sends them.
v1::ChangeSceneRequest three_changes() {
  v1::ChangeSceneRequest request;
  request.set_session_id(kId);
  request.set_next_frame(1);
  request.set_key(std::string(36, 'k'));
  for (int i = 0; i < 2; ++i) {
    const server::AddBody add = octahedron_to_add();
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
    SceneChurn& churn, server::ChangeOrder order, const std::function<void()>& meanwhile = [] {}) {
  std::promise<void> go;
  const auto until_go = [ready = go.get_future().share()] { ready.wait(); };
  for (const server::Lane lane : {server::Lane::kShort, server::Lane::kLong})
    for (int i = 0; i < SceneChurn::kThreads; ++i) churn.runner.post(until_go, lane);
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
  SceneChurn churn_{4 << 20};
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
  const auto flag = std::make_shared<std::atomic<bool>>(false);
  given_up.given_up = flag;
  const Reply reply = reply_to(churn_, std::move(given_up), [&flag] { flag->store(true); });
  EXPECT_EQ(reply.code, ErrorCode::kCancelled);
  EXPECT_EQ(reply.held, before_);
}

TEST_F(WaitingChangesTest, AreChargedUntilTheSessionIsClosed) {
  const Reply reply = reply_to(churn_, order(), [this] { churn_.session->close_as("was deleted"); });
  EXPECT_EQ(reply.code, ErrorCode::kNotFound);
  EXPECT_EQ(reply.held, before_);
}

TEST_F(WaitingChangesTest, AreNotChargedWhereTooManyWait) {
  SceneChurn full(4 << 20, 0);
  const std::size_t before = full.account->held();
  auto made = server::change_order_from(three_changes(), server::Dtype::kFloat64, {}, full.account);
  ASSERT_TRUE(made.ok());
  const Reply reply = reply_to(full, std::move(made).value());
  EXPECT_EQ(reply.code, ErrorCode::kResourceExhausted);
  EXPECT_EQ(reply.held, before);
}

}  // namespace
}  // namespace warmfront::test
