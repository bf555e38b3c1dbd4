// SPDX-License-Identifier: Apache-2.0
// The real warmfrontd as a process of its own: drained by SIGTERM and killed in the middle of streaming.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <thread>
#include <vector>

#include "client/lib/client.h"
#include "engine/collider.h"
#include "tests/support/hostile_scenes.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/log_events.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/test_certificates.h"
#include "tests/unit/server/warmfrontd_process.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

extern char** environ;

namespace warmfront::test {
namespace {

using namespace std::chrono_literals;
using client::Answer;
using client::Client;
using client::Session;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using Doubles = std::span<const double>;

class EndToEndTest : public ::testing::Test {
 protected:
  Session open(Client& client) {
    const std::vector<double> start = grids_.positions(0);
    auto session = client.create_session(grids_.scene(), Doubles(start));
    EXPECT_TRUE(session.ok()) << session.error().message;
    return std::move(session).value();
  }
  void submit(Session& session, std::uint64_t frame) {
    const std::vector<double> positions = grids_.positions(frame);
    const auto sent = session.submit(Doubles(positions));
    ASSERT_TRUE(sent.ok()) << sent.error().message;
    EXPECT_EQ(sent.value(), frame);
  }
  void expect_answer(Session& session, std::uint64_t frame) {
    const Result<Answer> answer = session.next_answer();
    ASSERT_TRUE(answer.ok()) << answer.error().message;
    ASSERT_EQ(answer.value().frame, frame);
    ContactHash hash;
    const client::ContactTable& table = answer.value().contacts;
    hash.begin_step(table.size());
    for (std::size_t i = 0; i < table.size(); ++i)
      hash.add(table.kind[i], table.status[i], table.vertices[i], table.toi[i]);
    EXPECT_EQ(hash.value(), expected_[frame - 1]) << "frame " << frame;
  }
  /// Health of the service by grpc.health.v1, whose messages are simple enough to write here: field 1 of the
  /// request is the name, field 1 of the answer the status. -1 when there is no answer.
  static int health(const std::shared_ptr<grpc::Channel>& channel) {
    const std::string name = "warmfront.v1.CollisionService";
    const grpc::Slice slice(std::string("\x0a") + static_cast<char>(name.size()) + name);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + 10s);
    context.set_wait_for_ready(true);
    grpc::CompletionQueue queue;
    grpc::GenericStub stub(channel);
    const auto call =
        stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", grpc::ByteBuffer(&slice, 1), &queue);
    grpc::ByteBuffer response;
    grpc::Status status;
    call->StartCall();
    call->Finish(&response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    grpc::Slice answer;
    if (!status.ok() || !response.DumpToSingleSlice(&answer).ok() || answer.size() != 2) return -1;
    return answer.begin()[1];
  }

  static constexpr std::uint64_t kFrames = 40;
  const TemporaryFolder folder_;
  const MovingGrids grids_{12};
  const std::vector<std::uint64_t> expected_ = local_hashes(grids_, 0, kFrames);
  Process daemon_{folder_.path()};
  Client client_ = Client::connect(daemon_.address(), {.call_timeout = 20s}).value();
};

TEST_F(EndToEndTest, HealthIsServedAndAnIdleDaemonStopsAtOnce) {
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  EXPECT_EQ(health(channel), 1) << "SERVING";
  daemon_.terminate();
  EXPECT_EQ(daemon_.wait(), 0);
  const std::string log = daemon_.log();
  for (const char* event : {"starting", "listening", "draining", "drained", "stopped"})
    EXPECT_THAT(log, HasSubstr("\"event\":\"" + std::string(event) + "\""));
}

TEST(StartTest, AllLogLinesAreJsonIncludingThoseOfGrpc) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "d.sock");
  Process daemon(folder.path());
  const int status = daemon.wait();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 2) << status;
  std::vector<std::string> events;
  std::istringstream log(daemon.log());
  for (std::string line; std::getline(log, line);) events.push_back(nlohmann::json::parse(line)["event"]);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.front(), "starting");
  EXPECT_THAT(events, Contains("grpc"));
  EXPECT_EQ(events.back(), "failed");
}

/// Of whole lines of a log, those of an event.
/// What a client without TLS begins with, on a connection of its own that it then leaves.
void speak_plaintext(std::uint16_t port) {
  const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  constexpr std::string_view kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  EXPECT_EQ(::send(connection, kPreface.data(), kPreface.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(kPreface.size()));
  char nothing = 0;
  while (::recv(connection, &nothing, 1, 0) > 0) {
  }
  ::close(connection);
}

TEST(StartTest, TlsHandshakeErrorsAreLoggedAtMostOnceASecond) {
  const TemporaryFolder folder;
  const auto file = [&](const char* name) { return (folder.path() / name).string(); };
  const Certificate ca("ca", nullptr), stranger("stranger", nullptr);
  ca.write(folder.path(), "ca");
  stranger.write(folder.path(), "stranger");
  Certificate("daemon", &ca, "DNS:localhost,IP:127.0.0.1").write(folder.path(), "daemon");
  const Process daemon(folder.path(), {"--listen", "127.0.0.1:0", "--tls-cert", file("daemon.pem"),
                                       "--tls-key", file("daemon.key"), "--tls-client-ca", file("ca.pem")});
  ASSERT_TRUE(Client::connect(daemon.address(), {.call_timeout = 20s}).ok());
  std::string address;
  for (const nlohmann::json& listening : events_of(daemon.log(), "listening"))
    if (listening["encrypted"]) address = listening["address"];
  ASSERT_FALSE(address.empty());

  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 50; ++i)
    speak_plaintext(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  client::ClientOptions options{.call_timeout = 2s};
  options.security.ca_file = file("ca.pem");
  // Retried: on a busy machine a client may give up before its handshake.
  const auto refused_until_logged = [&](const char* reason) {
    for (int i = 0; i < 20; ++i) {
      EXPECT_FALSE(Client::connect(address, options).ok()) << reason;
      for (const nlohmann::json& failed : events_of(daemon.log(), "handshake_failed"))
        if (std::string(failed["reason"]).find(reason) != std::string::npos) return;
    }
  };
  refused_until_logged("showed no certificate");
  options.security.cert_file = file("stranger.pem");
  options.security.key_file = file("stranger.key");
  refused_until_logged("none of --tls-client-ca signed it");
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start).count();

  std::map<std::string, int> reasons;
  for (const nlohmann::json& failed : events_of(daemon.log(), "handshake_failed"))
    ++reasons[failed["reason"]];
  EXPECT_EQ(reasons.size(), 3u) << daemon.log();
  for (const auto& [reason, count] : reasons) {
    EXPECT_LE(count, seconds + 2) << reason;
    EXPECT_THAT(reason, AnyOf(HasSubstr("does not speak TLS"), HasSubstr("showed no certificate"),
                              HasSubstr("none of --tls-client-ca signed it")));
  }
}

TEST_F(EndToEndTest, SigtermInTheMiddleOfStreamingLosesNoAnswer) {
  // A bare stream takes the session over, so that nothing is resent: what was sent must all come back.
  Session session = open(client_);
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::CollisionService::NewStub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 60s);
  const auto stream = stub->StreamSteps(&context);
  v1::StreamStepsRequest request;
  request.mutable_attach()->set_session_id(session.id());
  request.mutable_attach()->set_takeover(true);
  v1::StreamStepsResponse response;
  ASSERT_TRUE(stream->Write(request) && stream->Read(&response));
  constexpr std::uint64_t kSent = 20;
  for (std::uint64_t k = 1; k <= kSent; ++k) {
    const std::vector<double> positions = grids_.positions(k);
    request.mutable_step()->set_frame(k);
    request.mutable_step()->set_positions(positions.data(), positions.size() * sizeof(double));
    ASSERT_TRUE(stream->Write(request));
    if (k == kSent / 2) daemon_.terminate();
  }
  std::uint64_t answered = 0;
  bool noticed = false;
  while (stream->Read(&response)) {
    noticed = noticed || response.has_draining();
    if (!response.has_answer()) continue;
    EXPECT_EQ(response.answer().frame(), answered + 1);
    if (response.answer().last()) ++answered;
  }
  EXPECT_TRUE(noticed);
  EXPECT_EQ(answered, kSent);
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(daemon_.wait(), 0);
  EXPECT_THAT(daemon_.log(), HasSubstr("\"calls_cut_off\":0"));
}

TEST_F(EndToEndTest, TheClientSurvivesDrainsAndKillsWithOneAnswerAFrame) {
  Session session = open(client_);
  std::uint64_t sent = 0;
  for (std::uint64_t k = 1; k <= kFrames; ++k) {
    while (sent < kFrames && sent < k - 1 + session.window()) submit(session, ++sent);
    if (k % 10 == 3) {
      daemon_.terminate();
      EXPECT_EQ(daemon_.wait(), 0);
      daemon_.start();
    } else if (k % 10 == 8) {
      daemon_.kill_hard();
      daemon_.start();
    }
    expect_answer(session, k);
  }
  EXPECT_GE(session.resumes(), 6u);
  EXPECT_EQ(session.next_answer().error().code, ErrorCode::kFailedPrecondition) << "no answer came twice";
  // The last answers may have been read before the last kill: the daemon may still be starting.
  EXPECT_TRUE(client_.server_info().ok());
  const Status closed = session.close();
  EXPECT_TRUE(closed.ok()) << closed.error().message;
}

// The daemon gives up what it computes for longer than it has, and the client sends it to the next one.
TEST_F(EndToEndTest, TheClientSurvivesADrainThatIsShorterThanItsStep) {
  const TemporaryFolder folder;
  Process daemon(folder.path(), {"--drain-timeout", "400ms"});
  Client client = Client::connect(daemon.address(), {.call_timeout = 20s}).value();
  const testing::HostileScene scene = testing::coincident_triangles(500, BodyKind::kDeformable);
  std::vector<double> apart = scene.positions;
  for (std::size_t i = 0; i < apart.size(); ++i) apart[i] += 3.0 * static_cast<double>(i / 9);
  const ColliderOptions options{.report = Report::kCount};
  Session session = client.create_session(scene.description, Doubles(apart), options).value();
  EXPECT_TRUE(session.shares_memory());
  ASSERT_TRUE(session.submit(Doubles(scene.positions)).ok());
  int status = 0;
  std::thread operating([&] {
    std::this_thread::sleep_for(100ms);  // it computes by then, as a rule
    daemon.terminate();
    status = daemon.wait();
    daemon.start();
  });
  const Result<Answer> answer = session.next_answer();
  operating.join();
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  Collider here = Collider::create(std::make_shared<const Scene>(Scene::create(scene.description).value()),
                                   Doubles(apart), options, std::make_shared<Workers>(2))
                      .value();
  EXPECT_EQ(answer.value().vf, here.step(Doubles(scene.positions)).value().vf);
  EXPECT_THAT(daemon.log(), HasSubstr("\"calls_given_up\":"));
  // On a busy machine the refusal may not be delivered in the tenth of a second that is left for it.
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_TRUE(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 2) << status;
}

TEST_F(EndToEndTest, ClosingSurvivesARestartOfTheDaemon) {
  Session session = open(client_);
  daemon_.kill_hard();
  daemon_.start();
  // A call is tried again for a second or two, in which a slow machine starts no daemon.
  for (int i = 0; i < 100 && !Client::connect(daemon_.address()).ok(); ++i) {
  }
  const Status closed = session.close();
  EXPECT_TRUE(closed.ok()) << closed.error().message;
}

TEST_F(EndToEndTest, ASecondDaemonDoesNotTakeTheSocketAway) {
  ASSERT_TRUE(client_.server_info().ok());
  Process second(folder_.path());
  const int status = second.wait();
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_THAT(daemon_.log(), HasSubstr("another process listens there"));
  EXPECT_TRUE(client_.server_info().ok());
}

TEST_F(EndToEndTest, OneOfSeveralDaemonsStartedAtOnceOnOnePathServes) {
  daemon_.kill_hard();  // its socket and its lock are left behind
  for (int round = 0; round < 12; ++round) {
    std::vector<std::unique_ptr<Process>> daemons;
    for (int i = 0; i < 3; ++i) daemons.push_back(std::make_unique<Process>(folder_.path()));
    int refused = 0;
    for (int i = 0; i < 2000 && refused < 2; ++i) {
      for (auto& daemon : daemons) {
        if (!daemon) continue;
        const std::optional<int> status = daemon->ended();
        if (!status) continue;
        ASSERT_TRUE(WIFEXITED(*status));
        EXPECT_EQ(WEXITSTATUS(*status), 2);
        daemon.reset();
        ++refused;
      }
      std::this_thread::sleep_for(10ms);
    }
    ASSERT_EQ(refused, 2) << "round " << round;
    const Result<Client> client = Client::connect(daemon_.address());
    EXPECT_TRUE(client.ok()) << "round " << round;
  }
}

}  // namespace
}  // namespace warmfront::test
