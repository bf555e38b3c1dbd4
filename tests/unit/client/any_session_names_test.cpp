// SPDX-License-Identifier: Apache-2.0
// Names of bodies, in this process and behind a daemon: what is no UTF-8, which nobody could read, is refused
// in the same words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/lib/any_session.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::client {
namespace {

using ::testing::HasSubstr;

const std::vector<double> kCorners = {0, 0, 0, 1, 0, 0, 0, 1, 0};

SceneDescription triangle_named(const std::string& name) {
  return {.vertex_count = 3, .faces = {{0, 1, 2}}, .bodies = {{name, 0, 3}}};
}

TEST(AnySessionNames, AreUtf8) {
  const std::span<const double> start(kCorners);
  const test::LocalDaemon daemon;
  Client client = Client::connect(daemon.address()).value();
  const std::string good = "\u00e9toffe", bad = "sleeve \xff";
  for (const bool remote : {false, true}) {
    const auto create = [&](const std::string& name) -> Result<AnySession> {
      if (!remote) return AnySession::create(triangle_named(name), start, {});
      Result<Session> session = client.create_session(triangle_named(name), start, {});
      if (!session) return session.error();
      return AnySession(std::move(session).value());
    };
    const auto refused = [&](const auto& result, const std::string& where) {
      ASSERT_FALSE(result.ok()) << remote;
      EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(result.error().message, HasSubstr(where + ".name: is no UTF-8 from byte 7 on")) << remote;
    };
    refused(create(bad), "bodies[0]");
    Result<AnySession> made = create(good);
    ASSERT_TRUE(made.ok()) << remote;
    AnySession& session = made.value();
    refused(session.change_body(0, {bad, 0, 3}), "bodies[0]");
    BodyAddition another{triangle_named(bad).bodies[0], {{0, 1, 2}}};
    refused(session.add_body(another, start), "bodies[1]");
    another.body.name = good + good;
    const Result<std::uint32_t> added = session.add_body(another, start);
    ASSERT_TRUE(added.ok()) << remote;
    EXPECT_EQ(added.value(), 1U) << "what was refused was added";
  }
}

}  // namespace
}  // namespace warmfront::client
