// SPDX-License-Identifier: Apache-2.0
// The client library against a daemon in this process: the same bits, pipelining, errors, resuming, many at
// once.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <limits>
#include <thread>

#include "client/lib/client.h"
#include "tests/unit/server/answer_hash.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using client::Answer;
using client::Client;
using client::Session;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

class ClientSessionTest : public ::testing::Test {
 protected:
  Session open(const MovingGrids& grids, const client::SessionOptions& options = {}) {
    const std::vector<double> start = grids.positions(options.first_frame);
    auto session = client_.create_session(grids.scene(), Doubles(start), {}, options);
    EXPECT_TRUE(session.ok()) << session.error().message;
    return std::move(session).value();
  }
  static Result<Answer> step(Session& session, const MovingGrids& grids, std::uint64_t frame) {
    const std::vector<double> positions = grids.positions(frame);
    return session.step(Doubles(positions));
  }
  static Result<std::uint64_t> submit(Session& session, const MovingGrids& grids, std::uint64_t frame) {
    const std::vector<double> positions = grids.positions(frame);
    return session.submit(Doubles(positions));
  }

  const MovingGrids grids_{6};
  LocalDaemon daemon_;
  Client client_ = Client::connect(daemon_.address()).value();
};

int send_bytes(int socket) {
  int domain = 0, bytes = 0;
  socklen_t length = sizeof domain;
  if (getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &length) != 0 || domain != AF_UNIX) return 0;
  length = sizeof bytes;
  return getsockopt(socket, SOL_SOCKET, SO_SNDBUF, &bytes, &length) == 0 ? bytes : 0;
}

TEST(ClientConnectTest, SaysWhyNoDaemonAnswers) {
  const std::string nobody =
      "unix:" + ::testing::TempDir() + "warmfront-nobody-listens.sock";  // in a folder that is there
  const auto client = Client::connect(nobody, {.call_timeout = std::chrono::milliseconds(100)});
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(client.error().message, HasSubstr("no Warmfront daemon answers"));
  EXPECT_THAT(client.error().message, HasSubstr("No such file or directory")) << "and not that time was up";
}

TEST(ClientTimes, AreWaitedForHoweverLong) {
  LocalDaemon daemon;
  const MovingGrids grids(3);
  constexpr auto kEver = std::chrono::milliseconds::max();
  Client client =
      Client::connect(
          daemon.address(),
          {.call_timeout = kEver, .create_timeout = kEver, .answer_timeout = kEver, .resume_timeout = kEver})
          .value();
  const std::vector<double> start = grids.positions(0), next = grids.positions(1);
  Session session = client.create_session(grids.scene(), Doubles(start)).value();
  daemon.restart();
  EXPECT_TRUE(session.step(Doubles(next)).ok());
  EXPECT_EQ(session.resumes(), 1U);
}

TEST_F(ClientSessionTest, AUnixSocketTakesALargeFrameAtOnce) {
  const int fresh = socket(AF_UNIX, SOCK_STREAM, 0);
  const int usual = send_bytes(fresh);
  close(fresh);
  int most = 0;
  std::ifstream("/proc/sys/net/core/wmem_max") >> most;
  const int expected = 2 * std::min(most, 2 << 20);  // Linux counts its own share too
  if (expected <= usual) GTEST_SKIP() << "the system allows no more than the usual " << usual << " bytes";
  std::vector<int> sizes;
  for (int file = 3; file < 1024; ++file) sizes.push_back(send_bytes(file));
  EXPECT_THAT(sizes, ::testing::Contains(expected));
}

TEST_F(ClientSessionTest, TheSameBitsAsInThisProcess) {
  Session session = open(grids_);
  const auto expected = local_hashes(grids_, 0, 10);
  for (std::uint64_t k = 1; k <= 10; ++k) {
    const Result<Answer> answer = step(session, grids_, k);
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(answer.value().frame, k);
    EXPECT_EQ(hash_of(answer.value()), expected[k - 1]);
    EXPECT_GT(answer.value().contacts.size(), 0u);
  }
  EXPECT_EQ(session.resumes(), 0u);
  EXPECT_EQ(client_.list_sessions().value().size(), 1u);
  EXPECT_EQ(client_.get_session(session.id()).value().last_frame, 10u);
  EXPECT_TRUE(session.close().ok());
  EXPECT_TRUE(client_.list_sessions().value().empty());
  EXPECT_EQ(step(session, grids_, 11).error().code, ErrorCode::kFailedPrecondition);
}

TEST_F(ClientSessionTest, PipelinesUpToTheWindow) {
  Session session = open(grids_);
  const auto expected = local_hashes(grids_, 0, 12);
  std::uint64_t sent = 0;
  for (std::uint64_t k = 1; k <= 12; ++k) {
    while (sent < 12 && sent < k - 1 + session.window())
      ASSERT_EQ(submit(session, grids_, ++sent).value(), sent);
    if (k == 1) {
      const auto refused = submit(session, grids_, 99);
      EXPECT_EQ(refused.error().code, ErrorCode::kFailedPrecondition);
      EXPECT_EQ(step(session, grids_, 99).error().code, ErrorCode::kFailedPrecondition);
    }
    EXPECT_EQ(hash_of(session.next_answer().value()), expected[k - 1]);
  }
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kFailedPrecondition);
}

TEST_F(ClientSessionTest, AFrameThatFailsDoesNotCount) {
  Session session = open(grids_);
  ASSERT_TRUE(step(session, grids_, 1).ok());
  std::vector<double> bad = grids_.positions(2);
  bad[3 * 9] = std::numeric_limits<double>::infinity();
  ASSERT_EQ(session.submit(Doubles(bad)).value(), 2u);
  ASSERT_EQ(submit(session, grids_, 3).value(), 3u);
  const Result<Answer> failed = session.next_answer();
  EXPECT_EQ(failed.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(failed.error().message, HasSubstr("9"));
  EXPECT_EQ(submit(session, grids_, 2).error().code, ErrorCode::kFailedPrecondition)
      << "frame 3 is still outstanding";
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kFailedPrecondition);
  ASSERT_EQ(submit(session, grids_, 2).value(), 2u);
  EXPECT_EQ(hash_of(session.next_answer().value()), local_hashes(grids_, 0, 2).back());
  const std::vector<float> floats(3 * grids_.vertex_count());
  EXPECT_EQ(session.submit(std::span<const float>(floats)).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(session.submit(Doubles(bad).subspan(1)).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ClientSessionTest, ARestartedDaemonIsResumedWithTheSameBits) {
  Session session = open(grids_);
  const auto expected = local_hashes(grids_, 0, 12);
  std::uint64_t sent = 0;
  for (std::uint64_t k = 1; k <= 12; ++k) {
    while (sent < 12 && sent < k + 1) ASSERT_TRUE(submit(session, grids_, ++sent).ok());
    if (k % 4 == 0) daemon_.restart();
    const Result<Answer> answer = session.next_answer();
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    EXPECT_EQ(answer.value().frame, k);
    EXPECT_EQ(hash_of(answer.value()), expected[k - 1]);
  }
  EXPECT_GE(session.resumes(), 2u) << "after the last restart all answers may be here already";
}

TEST_F(ClientSessionTest, ADeletedSessionIsCreatedAgain) {
  std::vector<std::string> lost;
  client_ =
      Client::connect(daemon_.address(), {.on_lost = [&](const Error& why) { lost.push_back(why.message); }})
          .value();
  Session session = open(grids_);
  const auto expected = local_hashes(grids_, 0, 3);
  ASSERT_TRUE(step(session, grids_, 1).ok());
  ASSERT_TRUE(client_.delete_session(session.id()).ok());
  const Result<Answer> second = step(session, grids_, 2);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(hash_of(second.value()), expected[1]);
  EXPECT_EQ(session.resumes(), 1u);
  EXPECT_THAT(lost, ElementsAre(HasSubstr("deleted")));
}

TEST_F(ClientSessionTest, AnIdIsTakenOnlyOnce) {
  const Session session = open(grids_);
  const std::vector<double> start = grids_.positions(0);
  const auto second = client_.create_session(grids_.scene(), Doubles(start), {}, {.id = session.id()});
  EXPECT_EQ(second.error().code, ErrorCode::kAlreadyExists);
  EXPECT_TRUE(client_.get_session(session.id()).ok()) << "the failed one did not close it";
}

TEST_F(ClientSessionTest, ASessionTakenOverByAnotherClientFailsPermanently) {
  std::vector<std::string> lost;
  client_ =
      Client::connect(daemon_.address(), {.on_lost = [&](const Error& why) { lost.push_back(why.message); }})
          .value();
  Session session = open(grids_);
  ASSERT_TRUE(step(session, grids_, 1).ok());
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto thief = stub->StreamSteps(&context);
  v1::StreamStepsRequest request;
  request.mutable_attach()->set_session_id(session.id());
  request.mutable_attach()->set_takeover(true);
  v1::StreamStepsResponse response;
  ASSERT_TRUE(thief->Write(request) && thief->Read(&response));
  const Result<Answer> taken = step(session, grids_, 2);
  EXPECT_THAT(lost, ElementsAre()) << "a session taken over by another client is not resumed";
  EXPECT_EQ(taken.error().code, ErrorCode::kAborted);
  EXPECT_EQ(step(session, grids_, 2).error().code, ErrorCode::kAborted);
  context.TryCancel();
  EXPECT_FALSE(thief->Finish().ok());
}

TEST_F(ClientSessionTest, BadScenesAreRefusedNamingFieldAndIndex) {
  SceneDescription scene = grids_.scene();
  scene.faces[3][1] = 4000;
  const std::vector<double> start = grids_.positions(0);
  const auto session = client_.create_session(scene, Doubles(start));
  EXPECT_EQ(session.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(session.error().message, HasSubstr("3"));
  EXPECT_EQ(client_.create_session(grids_.scene(), Doubles(start), {}, {.id = "mine"}).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_TRUE(client_.list_sessions().value().empty()) << "nothing is left of what failed";
}

TEST_F(ClientSessionTest, OptionsOfOneQuestionAreNotASessions) {
  const std::vector<double> start = grids_.positions(0);
  Session session = open(grids_);
  for (const auto& [options, name] : std::vector<std::pair<ColliderOptions, const char*>>{
           {{.leave_out_overlaps = true}, "leave_out_overlaps"},
           {{.reduced = true}, "reduced"},
           {{.keep_distance = 0.5}, "keep_distance"},
           {{.pair_test = PairTest::kProximity}, "pair_test"},
           {{.instant = Instant::kEnd}, "instant"}}) {
    EXPECT_THAT(client_.create_session(grids_.scene(), Doubles(start), options).error().message,
                HasSubstr(name));
    EXPECT_THAT(session.change_options(options).error().message, HasSubstr(name));
  }
  EXPECT_TRUE(step(session, grids_, 1).ok());
}

TEST_F(ClientSessionTest, ADaemonThatIsNotRunningIsUnavailable) {
  const auto client =
      Client::connect("unix:/nonexistent/warmfront.sock", {.call_timeout = std::chrono::milliseconds(200)});
  EXPECT_EQ(client.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(client.error().message, HasSubstr("there is no folder /nonexistent;"));
}

// A busy or distant daemon: repeated connection attempts would only add to its load.
TEST_F(ClientSessionTest, ASlowDaemonIsConnectedToOnce) {
  const std::string path = ::testing::TempDir() + "warmfront_silent_" + std::to_string(getpid());
  sockaddr_un address{AF_UNIX, {}};
  ASSERT_LT(path.size(), sizeof address.sun_path);
  path.copy(address.sun_path, path.size());
  const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(listen(listener, 64), 0);
  const auto client = Client::connect("unix:" + path, {.call_timeout = std::chrono::milliseconds(1500)});
  EXPECT_EQ(client.error().code, ErrorCode::kUnavailable);
  int connections = 0;
  for (int accepted = 0; (accepted = accept(listener, nullptr, nullptr)) >= 0; ++connections) close(accepted);
  EXPECT_EQ(connections, 1);
  close(listener);
  unlink(path.c_str());
}

TEST_F(ClientSessionTest, GivesUpWhenTheDaemonDoesNotReturn) {
  Client client =
      Client::connect(daemon_.address(), {.resume_timeout = std::chrono::milliseconds(300)}).value();
  const std::vector<double> start = grids_.positions(0);
  Session session = client.create_session(grids_.scene(), Doubles(start)).value();
  ASSERT_TRUE(step(session, grids_, 1).ok());
  daemon_.stop();
  const auto lost = step(session, grids_, 2);
  EXPECT_EQ(lost.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(lost.error().message,
              ::testing::HasSubstr("could not be resumed within the resume timeout of 300 ms: "));
  EXPECT_EQ(step(session, grids_, 2).error().code, ErrorCode::kUnavailable);
}

// Found by a user: it waited for as long as an upload may take.
TEST_F(ClientSessionTest, ANewSessionWaitsForADaemonNoLongerThanAResumedOne) {
  Client client = Client::connect(daemon_.address(), {.call_timeout = std::chrono::milliseconds(300),
                                                      .create_timeout = std::chrono::hours(1),
                                                      .resume_timeout = std::chrono::milliseconds(300)})
                      .value();
  daemon_.stop();
  const std::vector<double> start = grids_.positions(0);
  const auto refused = client.create_session(grids_.scene(), Doubles(start));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(refused.error().message,
              ::testing::HasSubstr("could not be made within the resume timeout of 300 ms: "));
}

TEST_F(ClientSessionTest, SixteenConcurrentSessionsAreAnsweredCorrectly) {
  std::atomic<int> right{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i) {
    threads.emplace_back([&, i] {
      const MovingGrids grids(4 + static_cast<std::uint32_t>(i % 3), 0.3 * i);
      const auto expected = local_hashes(grids, 0, 12);
      Client client = Client::connect(daemon_.address()).value();
      const std::vector<double> start = grids.positions(0);
      Session session = client.create_session(grids.scene(), Doubles(start)).value();
      std::uint64_t sent = 0;
      for (std::uint64_t k = 1; k <= 12; ++k) {
        while (sent < 12 && sent < k + 2) static_cast<void>(submit(session, grids, ++sent));
        const Result<Answer> answer = session.next_answer();
        if (answer.ok() && answer.value().frame == k && hash_of(answer.value()) == expected[k - 1]) ++right;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 16 * 12);
  EXPECT_TRUE(client_.list_sessions().value().empty()) << "each closed when it went";
}

}  // namespace
}  // namespace warmfront::test
