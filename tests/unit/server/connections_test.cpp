// SPDX-License-Identifier: Apache-2.0
// One client and many sessions over connections that carry few calls; and frames and answers larger than
// the connections' buffers.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using Doubles = std::span<const double>;

Session open(Client& client, const MovingGrids& grids) {
  const std::vector<double> start = grids.positions(0);
  auto session = client.create_session(grids.scene(), Doubles(start));
  EXPECT_TRUE(session.ok()) << session.error().message;
  return std::move(session).value();
}

server::Config few_calls() {
  server::Config config;
  config.limits.max_streams_per_connection = 2;
  return config;
}

/// A blocked call fails within seconds, not minutes.
client::ClientOptions impatient() {
  return {.call_timeout = std::chrono::seconds(10),
          .create_timeout = std::chrono::seconds(10),
          .answer_timeout = std::chrono::seconds(10),
          .resume_timeout = std::chrono::seconds(10)};
}

TEST(ConnectionsTest, AClientOpensAsManyAsItsSessionsNeed) {
  LocalDaemon daemon(few_calls());
  Client client = Client::connect(daemon.address(), impatient()).value();
  const MovingGrids grids(4);
  const auto expected = local_hashes(grids, 0, 2);
  std::vector<Session> sessions;
  for (int i = 0; i < 9; ++i) {
    const std::vector<double> start = grids.positions(0);
    auto session = client.create_session(grids.scene(), Doubles(start));
    ASSERT_TRUE(session.ok()) << "session " << i << ": " << session.error().message;
    sessions.push_back(std::move(session).value());
    ASSERT_TRUE(client.server_info().ok()) << i;
  }
  const auto step_all = [&](std::uint64_t frame) {
    for (Session& session : sessions) {
      const std::vector<double> positions = grids.positions(frame);
      const Result<Answer> answer = session.step(Doubles(positions));
      ASSERT_TRUE(answer.ok()) << answer.error().message;
      EXPECT_EQ(hash_of(answer.value()), expected[frame - 1]);
    }
  };
  step_all(1);
  // All are resumed, although the daemon allows fewer by then.
  daemon.restart([](server::Config& config) { config.limits.max_streams_per_connection = 1; });
  step_all(2);
  for (const Session& session : sessions) EXPECT_EQ(session.resumes(), 1U);
}

TEST(ConnectionsTest, SessionsInThreadsExceedTheStreamsOfOneConnection) {
  LocalDaemon daemon(few_calls());
  Client client = Client::connect(daemon.address(), impatient()).value();
  const MovingGrids grids(4);
  const auto expected = local_hashes(grids, 0, 3);
  std::vector<std::jthread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&] {
      Session session = open(client, grids);
      for (std::uint64_t k = 1; k <= expected.size(); ++k) {
        const std::vector<double> positions = grids.positions(k);
        const Result<Answer> answer = session.step(Doubles(positions));
        ASSERT_TRUE(answer.ok()) << answer.error().message;
        EXPECT_EQ(hash_of(answer.value()), expected[k - 1]);
      }
    });
}

/// Frames and answers larger than sockets and windows hold, to a daemon that stops reading while an answer is
/// pending.
TEST(ConnectionsTest, AWriterReadsTheAnswersThatBlockIt) {
  server::Config config;
  config.limits.max_queued_bytes = 1;
  config.limits.write_stall_timeout = std::chrono::seconds(10);
  LocalDaemon daemon(config);
  Client client = Client::connect(daemon.address()).value();
  const MovingGrids grids(260);
  Session session = open(client, grids);
  const std::uint64_t frames = session.window();
  ASSERT_GT(frames, 2U);
  // Before the first is sent: a client that does something else than read is cut off.
  const auto expected = local_hashes(grids, 0, frames);
  for (std::uint64_t k = 1; k <= frames; ++k) {
    const std::vector<double> positions = grids.positions(k);
    ASSERT_TRUE(session.submit(Doubles(positions)).ok());
    // The first answer waits, and the daemon reads no more, before the next frame is written.
    while (k == 1 && client.get_session(session.id()).value().last_frame == 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  for (std::uint64_t k = 1; k <= frames; ++k) {
    const Result<Answer> answer = session.next_answer();
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(hash_of(answer.value()), expected[k - 1]);
  }
  EXPECT_EQ(session.resumes(), 0U) << "neither side waited for the other";
}

}  // namespace
}  // namespace warmfront::test
