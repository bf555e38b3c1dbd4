// SPDX-License-Identifier: Apache-2.0
// Access control: tokens, certificates, sessions owned by their principal, the admin role, and credentials
// that are reloaded.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "client/lib/client.h"
#include "server/auth/tls.h"
#include "server/auth/tokens.h"
#include "server/observe/grpc_log.h"
#include "server/process/small_file.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/test_certificates.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using client::Client;
using client::ClientOptions;
using server::Tokens;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kAlice = "alice-0123456789abcdef";
constexpr const char* kBob = "bob-0123456789abcdef";
constexpr const char* kRoot = "root-0123456789abcdef";

TEST(TokensTest, AreReadLineByLineAndErrorsDoNotQuoteThem) {
  const Tokens tokens =
      Tokens::parse(std::string("# who\n\n") + kAlice + " alice\r\n" + kRoot + "  root admin\n").value();
  EXPECT_EQ(tokens.size(), 2u);
  EXPECT_EQ(tokens.find(kAlice)->name, "alice");
  EXPECT_FALSE(tokens.find(kAlice)->admin);
  EXPECT_TRUE(tokens.find(kRoot)->admin);
  EXPECT_FALSE(tokens.find(std::string(kAlice) + "x"));
  EXPECT_FALSE(tokens.find(""));
  for (const std::string& bad :
       {std::string("secret alice"), std::string(kAlice), std::string(kAlice) + " alice boss",
        std::string(kAlice) + " a\n" + kAlice + " b", std::string()}) {
    const auto read = Tokens::parse(bad);
    ASSERT_FALSE(read.ok()) << bad;
    EXPECT_THAT(read.error().message, Not(HasSubstr("alice-")));
  }
  EXPECT_THAT(Tokens::parse("\nsecret alice").error().message, HasSubstr("line 2"));
  for (const char* unreadable : {"/nonexistent", "/"})
    EXPECT_THAT(Tokens::read(unreadable).error().message, HasSubstr("cannot be read"));
  EXPECT_THAT(Tokens::read("/dev/null").error().message, HasSubstr("a regular file is expected"));
}

Result<client::Session> open(Client& client) {
  const MovingGrids grids(4);
  const std::vector<double> start = grids.positions(0);
  return client.create_session(grids.scene(), std::span<const double>(start));
}

class TokenTest : public ::testing::Test {
 protected:
  static void write(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path) << text;
  }

  server::Config config() {
    write(folder_.path() / "tokens",
          std::string(kAlice) + " alice\n" + kBob + " bob\n" + kRoot + " root admin\n");
    server::Config config;
    config.token_file = (folder_.path() / "tokens").string();
    return config;
  }
  Result<Client> connect(const std::string& token) { return connect(token, daemon_); }
  Result<Client> connect(const std::string& token, const LocalDaemon& daemon) {
    ClientOptions options;
    if (!token.empty()) {
      write(folder_.path() / "mine", token + "\n");
      options.security.token_file = (folder_.path() / "mine").string();
    }
    return Client::connect(daemon.address(), options);
  }

  const TemporaryFolder folder_;
  LocalDaemon daemon_{config()};
};

TEST_F(TokenTest, UnknownCallersAreRejected) {
  EXPECT_EQ(connect("").error().code, ErrorCode::kUnauthenticated);
  EXPECT_EQ(connect("wrong-0123456789abcdef").error().code, ErrorCode::kUnauthenticated);
  EXPECT_TRUE(connect(kAlice).ok());
  // A call without a token, or with a wrong one, is told how to send one.
  for (const char* token : {"", "wrong-0123456789abcdef"})
    EXPECT_THAT(connect(token).error().message, HasSubstr("\"authorization\", once, as \"Bearer TOKEN\""));
  // Every method requires it.
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::CollisionService::NewStub(channel);
  const auto context = [] {
    auto context = std::make_unique<grpc::ClientContext>();
    context->set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
    context->AddMetadata("authorization", "Basic 0123");
    return context;
  };
  const auto expect = [](const grpc::Status& status) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
  };
  v1::GetSessionResponse got;
  v1::ListSessionsResponse listed;
  v1::DeleteSessionResponse deleted;
  v1::StepResponse stepped;
  v1::CreateSessionResponse created;
  v1::StreamStepsResponse streamed;
  expect(stub->GetSession(context().get(), {}, &got));
  expect(stub->ListSessions(context().get(), {}, &listed));
  expect(stub->DeleteSession(context().get(), {}, &deleted));
  expect(stub->Step(context().get(), {}, &stepped));
  const auto create_context = context(), stream_context = context();
  expect(stub->CreateSession(create_context.get(), &created)->Finish());
  const auto stream = stub->StreamSteps(stream_context.get());
  EXPECT_FALSE(stream->Read(&streamed));
  expect(stream->Finish());
}

TEST_F(TokenTest, AnIdInUseByAnotherPrincipalLooksUnused) {
  Client alice = connect(kAlice).value(), bob = connect(kBob).value(), root = connect(kRoot).value();
  client::Session hers = open(alice).value();
  const auto stub = v1::CollisionService::NewStub(
      grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.AddMetadata("authorization", std::string("Bearer ") + kBob);
  v1::CreateSessionResponse created;
  const auto upload = stub->CreateSession(&context, &created);
  v1::CreateSessionRequest request;
  request.mutable_header()->set_session_id(hers.id());
  request.mutable_header()->set_vertex_count(3);
  request.mutable_header()->set_face_count(1);
  request.mutable_header()->set_dtype(v1::DTYPE_FLOAT64);
  const std::array<std::int32_t, 3> face{0, 1, 2};
  const std::array<double, 9> corners{0, 0, 0, 1, 0, 0, 0, 1, 0};
  upload->Write(request);
  request.set_faces(face.data(), sizeof(face));
  upload->Write(request);
  request.set_positions(corners.data(), sizeof(corners));
  upload->Write(request);
  upload->WritesDone();
  const grpc::Status status = upload->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message() << ": the error reveals that another principal uses this id";
  EXPECT_EQ(bob.get_session(hers.id()).value().face_count, 1u);
  EXPECT_GT(alice.get_session(hers.id()).value().face_count, 1u);
  // A caller with the admin role selects the owner.
  const Status whose = root.delete_any_session(hers.id());
  ASSERT_FALSE(whose.ok());
  EXPECT_EQ(whose.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(whose.error().message, HasSubstr("alice and bob"));
  EXPECT_TRUE(root.delete_any_session(hers.id(), "bob").ok());
  EXPECT_TRUE(alice.get_session(hers.id()).ok());
  EXPECT_FALSE(bob.get_session(hers.id()).ok());
}

/// How a call ends whose only message is these bytes.
grpc::Status call_with_bytes(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                             const std::string& bytes) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  grpc::CompletionQueue queue;
  grpc::GenericStub stub(channel);
  const grpc::Slice slice(bytes);
  const auto call = stub.PrepareUnaryCall(&context, method, grpc::ByteBuffer(&slice, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

TEST_F(TokenTest, NothingIsParsedBeforeAuthentication) {
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  for (const char* method :
       {"CollisionService/CreateSession", "CollisionService/GetSession", "CollisionService/ListSessions",
        "CollisionService/DeleteSession", "CollisionService/ChangeScene", "CollisionService/CheckSession",
        "CollisionService/Step", "CollisionService/StreamSteps", "CollisionService/GetServerInfo",
        "AdminService/ListAllSessions", "AdminService/DeleteAnySession"})
    // Not a valid message of any type: the first parser reports it.
    EXPECT_EQ(
        call_with_bytes(channel, std::string("/warmfront.v1.") + method, "\x07 is no message").error_code(),
        grpc::StatusCode::UNAUTHENTICATED)
        << method;
}

TEST_F(TokenTest, SessionsBelongToTheirPrincipalAndSomeCallsNeedTheAdminRole) {
  Client alice = connect(kAlice).value(), bob = connect(kBob).value(), root = connect(kRoot).value();
  client::Session session = open(alice).value();
  EXPECT_EQ(alice.list_sessions().value().size(), 1u);
  EXPECT_TRUE(bob.list_sessions().value().empty());
  EXPECT_TRUE(root.list_sessions().value().empty()) << "an administrator's own sessions are listed like any other";
  EXPECT_EQ(bob.get_session(session.id()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(bob.delete_session(session.id()).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(bob.list_all_sessions().error().code, ErrorCode::kPermissionDenied);
  EXPECT_EQ(bob.delete_any_session(session.id()).error().code, ErrorCode::kPermissionDenied);
  const auto all = root.list_all_sessions();
  ASSERT_TRUE(all.ok()) << all.error().message;
  ASSERT_EQ(all.value().size(), 1u);
  EXPECT_EQ(all.value()[0].principal, "alice");
  const std::vector<double> next = MovingGrids(4).positions(1);
  EXPECT_TRUE(session.step(std::span<const double>(next)).ok());
  EXPECT_TRUE(root.delete_any_session(session.id()).ok());
  EXPECT_TRUE(alice.list_sessions().value().empty());
  EXPECT_THAT(daemon_.log(), HasSubstr("\"principal\":\"alice\""));
  for (const char* secret : {kAlice, kBob, kRoot}) EXPECT_THAT(daemon_.log(), Not(HasSubstr(secret)));
}

class PrincipalBytesTest : public TokenTest {
 protected:
  static server::Config small(server::Config config) {
    config.limits.max_principal_bytes = 300 << 10;
    return config;
  }
  LocalDaemon small_{small(config())};
};

TEST_F(PrincipalBytesTest, APrincipalAtItsByteQuotaDoesNotBlockOthers) {
  Client alice = connect(kAlice, small_).value(), bob = connect(kBob, small_).value();
  std::vector<client::Session> sessions;
  Result<client::Session> next = open(alice);
  for (; next.ok() && sessions.size() < 100; next = open(alice)) sessions.push_back(std::move(next).value());
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.error().code, ErrorCode::kResourceExhausted);
  EXPECT_THAT(next.error().message, HasSubstr("--max-principal-bytes"));
  EXPECT_THAT(small_.log(), ContainsRegex("\"event\":\"create_refused\",\"session\":\"[0-9a-f-]+\","
                                          "\"principal\":\"alice\",\"code\":8,\"reason\":\""));
  EXPECT_GE(sessions.size(), 2u);
  EXPECT_TRUE(open(bob).ok()) << "the daemon has room for others";
  const std::vector<double> moved = MovingGrids(4).positions(1);
  EXPECT_TRUE(sessions.front().step(std::span<const double>(moved)).ok()) << "what it has goes on";
}

TEST_F(TokenTest, AuthenticationComesFirstAlsoWhileDraining) {
  // A running upload keeps the daemon from ending.
  Client alice = connect(kAlice).value();
  const auto channel = grpc::CreateChannel(daemon_.address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::CollisionService::NewStub(channel);
  grpc::ClientContext upload_context;
  upload_context.AddMetadata("authorization", std::string("Bearer ") + kAlice);
  v1::CreateSessionResponse created;
  const auto upload = stub->CreateSession(&upload_context, &created);
  v1::CreateSessionRequest request;
  request.mutable_header()->set_session_id("01234567-89ab-cdef-0123-456789abcdef");
  request.mutable_header()->set_vertex_count(3);
  request.mutable_header()->set_face_count(1);
  request.mutable_header()->set_dtype(v1::DTYPE_FLOAT64);
  ASSERT_TRUE(upload->Write(request));
  // The daemon has the upload in hand before it drains: its headers came before those of calls that it
  // answered.
  for (int call = 0; call < 5; ++call) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", std::string("Bearer ") + kAlice);
    v1::GetServerInfoResponse info;
    ASSERT_TRUE(stub->GetServerInfo(&context, {}, &info).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::atomic<bool> enough{false};
  std::thread uploading([&] {
    request.set_faces("");
    while (!enough && upload->Write(request)) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  std::thread draining([&] { daemon_->drain(); });
  Result<client::ServerInfo> info = alice.server_info();
  while (info.ok() && !info.value().draining) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    info = alice.server_info();
  }
  EXPECT_TRUE(info.ok()) << "it drained although an upload was in progress";

  const auto nobody = [] {
    auto context = std::make_unique<grpc::ClientContext>();
    context->AddMetadata("authorization", "Bearer nobody-0123456789abcdef");
    return context;
  };
  v1::ChangeSceneResponse changed;
  v1::StepResponse stepped;
  v1::CreateSessionResponse never;
  const auto create_context = nobody(), stream_context = nobody();
  for (const grpc::Status& status :
       {stub->ChangeScene(nobody().get(), {}, &changed), stub->Step(nobody().get(), {}, &stepped),
        stub->CreateSession(create_context.get(), &never)->Finish(),
        stub->StreamSteps(stream_context.get())->Finish()})
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << status.error_message();
  enough = true;
  uploading.join();
  draining.join();
}

TEST_F(TokenTest, TheFileIsReloadedAndAnErrorInItChangesNothing) {
  Client alice = connect(kAlice).value();
  write(folder_.path() / "tokens", "short bob\n");
  EXPECT_FALSE(daemon_->reload());
  EXPECT_TRUE(alice.list_sessions().ok());
  write(folder_.path() / "tokens", std::string(kBob) + " bob\n");
  EXPECT_TRUE(daemon_->reload());
  EXPECT_EQ(alice.list_sessions().error().code, ErrorCode::kUnauthenticated);
  EXPECT_TRUE(connect(kBob).ok());
}

TEST_F(TokenTest, RevokingATokenEndsItsStreams) {
  Client alice = connect(kAlice).value(), bob = connect(kBob).value();
  client::Session hers = open(alice).value(), his = open(bob).value();
  const MovingGrids grids(4);
  const std::vector<double> first = grids.positions(1), second = grids.positions(2);
  ASSERT_TRUE(hers.step(std::span<const double>(first)).ok());
  ASSERT_TRUE(his.step(std::span<const double>(first)).ok());
  // The same token under another name gives no access to her sessions.
  write(folder_.path() / "tokens", std::string(kAlice) + " mallory\n" + kBob + " bob admin\n");
  ASSERT_TRUE(daemon_->reload());
  const auto refused = hers.step(std::span<const double>(second));
  ASSERT_FALSE(refused.ok()) << "the stream goes on with a token that is revoked";
  EXPECT_TRUE(his.step(std::span<const double>(second)).ok());
}

TEST(ClientSecurityTest, ATokenIsNotSentUnencryptedToAnotherHost) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "t").string();
  std::ofstream(path) << kAlice;
  ClientOptions options;
  options.security.token_file = path;
  const auto refused = Client::connect("warmfront.example.org:1", options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("unencrypted"));
  options.security.token_file = "/nonexistent";
  EXPECT_THAT(Client::connect("127.0.0.1:1", options).error().message, HasSubstr("/nonexistent"));
}

class TlsTest : public ::testing::Test {
 protected:
  TlsTest() {
    ca_.write(folder_.path(), "ca");
    Certificate("wrong", nullptr).write(folder_.path(), "wrong");
    Certificate("daemon", &ca_, "DNS:localhost,IP:127.0.0.1").write(folder_.path(), "daemon");
    Certificate("carol", &ca_).write(folder_.path(), "carol");
    Certificate("dave", &ca_).write(folder_.path(), "dave");
    config_.listen = {"127.0.0.1:0"};
    config_.threads = 2;
    config_.tls = {file("daemon.pem"), file("daemon.key"), ""};
  }
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  void start() {
    auto started = server::Daemon::start(config_, log_);
    ASSERT_TRUE(started.ok()) << started.error().message;
    daemon_ = std::move(started).value();
  }
  Result<Client> connect(const std::string& ca, const std::string& name = {}) {
    ClientOptions options;
    options.call_timeout = std::chrono::seconds(ca == "ca.pem" ? 20 : 2);
    if (!ca.empty()) options.security.ca_file = file(ca);
    if (!name.empty()) {
      options.security.cert_file = file(name + ".pem");
      options.security.key_file = file(name + ".key");
    }
    return Client::connect(daemon_->addresses().front(), options);
  }

  const TemporaryFolder folder_;
  const Certificate ca_{"ca", nullptr};
  server::Config config_;
  std::string log_text() const { return log_text_.str(); }

  std::ostringstream log_text_;
  server::Log log_{server::LogLevel::kDebug, server::LogFormat::kJson, &log_text_};
  std::unique_ptr<server::Daemon> daemon_;
};

TEST_F(TlsTest, ClientsVerifyTheDaemonAndItsCertificateCanBeReplaced) {
  start();
  auto client = connect("ca.pem");
  ASSERT_TRUE(client.ok()) << client.error().message;
  EXPECT_TRUE(open(client.value()).ok());
  EXPECT_EQ(connect("wrong.pem").error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(connect("").error().code, ErrorCode::kUnavailable) << "plain text";
  // Another certificate authority is installed.
  const Certificate other("other", nullptr);
  other.write(folder_.path(), "other");
  Certificate("daemon", &other, "IP:127.0.0.1").write(folder_.path(), "daemon");
  EXPECT_TRUE(daemon_->reload());
  Result<Client> changed = connect("other.pem");
  for (int i = 0; i < 10 && !changed.ok(); ++i) changed = connect("other.pem");
  EXPECT_TRUE(changed.ok()) << changed.error().message;
  // Broken files are reported, and the old credentials stay in force.
  std::ofstream(file("daemon.key")) << other.key();
  EXPECT_FALSE(daemon_->reload());
  EXPECT_THAT(log_text_.str(), HasSubstr("daemon.key"));
}

TEST_F(TlsTest, ClientCertificatesIdentifyTheCaller) {
  config_.tls.client_ca = file("ca.pem");
  config_.admins = {"cn:dave"};
  start();
  auto carol = connect("ca.pem", "carol"), dave = connect("ca.pem", "dave");
  ASSERT_TRUE(carol.ok()) << carol.error().message;
  ASSERT_TRUE(dave.ok()) << dave.error().message;
  auto session = open(carol.value());
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_TRUE(dave.value().list_sessions().value().empty());
  EXPECT_EQ(carol.value().list_all_sessions().error().code, ErrorCode::kPermissionDenied);
  const auto all = dave.value().list_all_sessions();
  ASSERT_TRUE(all.ok()) << all.error().message;
  ASSERT_EQ(all.value().size(), 1u);
  EXPECT_EQ(all.value()[0].principal, "cn:carol");
  ClientOptions anonymous;
  anonymous.call_timeout = std::chrono::seconds(2);
  anonymous.security.ca_file = file("ca.pem");
  EXPECT_FALSE(Client::connect(daemon_->addresses().front(), anonymous).ok())
      << "no certificate, no connection";
}

TEST_F(TlsTest, ACertificateWithoutANameIsRejectedAndKindsOfNamesAreDistinct) {
  Certificate("", &ca_).write(folder_.path(), "nameless");
  Certificate("local", &ca_).write(folder_.path(), "local");
  Certificate("x", &ca_, "DNS:carol").write(folder_.path(), "host");
  Certificate("x", &ca_, "email:carol,URI:spiffe://grid/carol").write(folder_.path(), "workload");
  config_.tls.client_ca = file("ca.pem");
  config_.listen.push_back("unix:" + file("d.sock"));
  config_.admins = {"cn:dave"};
  start();
  EXPECT_EQ(connect("ca.pem", "nameless").error().code, ErrorCode::kUnauthenticated);
  Client local = connect("ca.pem", "local").value();
  EXPECT_EQ(local.list_all_sessions().error().code, ErrorCode::kPermissionDenied)
      << "this name is the Unix socket's";
  Client by_socket = Client::connect("unix:" + file("d.sock")).value();
  const client::Session at_home = open(by_socket).value();
  EXPECT_TRUE(local.list_sessions().value().empty());
  Client carol = connect("ca.pem", "carol").value(), host = connect("ca.pem", "host").value();
  Client workload = connect("ca.pem", "workload").value(), dave = connect("ca.pem", "dave").value();
  const client::Session of_carol = open(carol).value(), of_host = open(host).value(),
                        of_workload = open(workload).value();
  for (Client* one : {&carol, &host, &workload}) EXPECT_EQ(one->list_sessions().value().size(), 1u);
  std::set<std::string> principals;
  const auto all = dave.list_all_sessions();
  for (const auto& session : all.value()) principals.insert(session.principal);
  EXPECT_THAT(principals,
              ::testing::ElementsAre("cn:carol", "dns:carol", "local", "uri:spiffe://grid/carol"));
}

TEST_F(TlsTest, BadFileContentsNeverStopTheDaemon) {
  start();
  ASSERT_TRUE(connect("ca.pem").ok());
  const std::string good = Certificate::read(file("daemon.pem")), key = Certificate::read(file("daemon.key"));
  const auto write = [&](const char* name, const std::string& text) { std::ofstream(file(name)) << text; };
  // A script that copies the same files periodically, while clients connect.
  for (int copy = 0; copy < 400; ++copy) {
    write("daemon.pem", good);
    write("daemon.key", key);
  }
  EXPECT_TRUE(connect("ca.pem").ok());
  // Empty, halved, of another key, with a byte that is no text, not there: noticed, and the old one serves.
  const Certificate other("daemon", &ca_, "IP:127.0.0.1");
  for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2), other.certificate(),
                                 good + std::string(1, '\0'), std::string("-----BEGIN")}) {
    write("daemon.pem", bad);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_TRUE(connect("ca.pem").ok()) << bad.size();
  }
  write("daemon.pem", "");
  for (int i = 0; i < 200 && log_text().find("still serves") == std::string::npos; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_THAT(log_text(), HasSubstr("what was in force before still serves"));
  EXPECT_TRUE(connect("ca.pem").ok());
  std::filesystem::remove(file("daemon.pem"));
  EXPECT_TRUE(connect("ca.pem").ok());
  // A new pair is loaded without a signal.
  Certificate("second", nullptr).write(folder_.path(), "second");
  const Certificate second("second", nullptr);
  second.write(folder_.path(), "second");
  Certificate("daemon", &second, "IP:127.0.0.1").write(folder_.path(), "daemon");
  Result<Client> changed = connect("second.pem");
  for (int i = 0; i < 20 && !changed.ok(); ++i) changed = connect("second.pem");
  EXPECT_TRUE(changed.ok()) << changed.error().message;
}

TEST_F(TlsTest, ACertificateAboutToExpireIsLogged) {
  start();  // it has an hour left
  EXPECT_THAT(log_text(), HasSubstr("certificate_expires"));
  EXPECT_THAT(log_text(), HasSubstr("\"hours_left\":"));
}

TEST_F(TlsTest, WorldReadableSecretsAreWarnedOfOnceAtStartup) {
  namespace fs = std::filesystem;
  const std::string tokens = file("tokens");
  std::ofstream(tokens) << kAlice << " alice\n";
  config_.token_file = tokens;
  for (const std::string& secret : {tokens, file("daemon.key")})
    fs::permissions(secret, fs::perms::owner_read | fs::perms::group_read);
  start();
  EXPECT_THAT(log_text(), Not(HasSubstr("secret_readable")));
  for (const std::string& secret : {tokens, file("daemon.key")})
    fs::permissions(secret, fs::perms::others_read, fs::perm_options::add);
  start();
  EXPECT_TRUE(daemon_->reload());
  const std::string log = log_text();
  for (const std::string& secret : {tokens, file("daemon.key")}) {
    const std::string line = "\"event\":\"secret_readable\",\"file\":\"" + secret + "\"";
    const std::size_t at = log.find(line);
    ASSERT_NE(at, std::string::npos) << log;
    EXPECT_EQ(log.find(line, at + 1), std::string::npos) << "once";
  }
}

TEST(GrpcLogTest, NamesTheLikelyCauseOfAFailedHandshake) {
  using server::why_handshake_failed;
  const std::string begin = "Handshake failed with fatal error SSL_ERROR_SSL: error:0A0000C7:SSL routines::";
  EXPECT_THAT(std::string(why_handshake_failed(begin + "peer did not return a certificate.")),
              HasSubstr("showed no certificate"));
  EXPECT_THAT(std::string(why_handshake_failed(begin + "certificate verify failed.")),
              HasSubstr("--tls-client-ca"));
  EXPECT_THAT(std::string(why_handshake_failed(begin + "wrong version number.")),
              HasSubstr("does not speak TLS"));
  EXPECT_FALSE(why_handshake_failed(begin + "something new.").empty());
  EXPECT_TRUE(why_handshake_failed("No address added out of total 1 resolved").empty());
}

TEST(GrpcLogTest, RepeatedMessagesAreLoggedOnceASecondWithTheirCount) {
  server::Repeats repeats;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(repeats.admit("a", start), 0u);
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(repeats.admit("a", start + std::chrono::microseconds(999 * i)));
  EXPECT_EQ(repeats.admit("a", start + std::chrono::seconds(1)), 1000u);
  EXPECT_EQ(repeats.admit("a", start + std::chrono::seconds(2)), 0u);
}

TEST(SmallFileTest, DevicesPipesAndEndlessFilesAreRefused) {
  using server::read_small_file;
  const TemporaryFolder folder;
  const std::string pipe = (folder.path() / "pipe").string(), large = (folder.path() / "large").string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/zero"), std::string("/dev/null"), pipe, std::string("/")})
    EXPECT_THAT(read_small_file("config", path).error().message, HasSubstr("a regular file is expected"))
        << path;
  EXPECT_THAT(read_small_file("config", "/nonexistent").error().message,
              HasSubstr("config /nonexistent: it cannot be read (No such file"));
  std::ofstream(large) << std::string(2 << 20, ' ');
  EXPECT_THAT(read_small_file("token-file", large).error().message, HasSubstr("at most 1048576 bytes"));
}

TEST(SmallFileTest, AFileThatIsBeingWrittenIsReadWhole) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "tokens").string();
  // Half of the file is written, and the writer continues.
  std::atomic<bool> begun{false};
  std::thread writer([&] {
    std::ofstream file(path);
    for (int piece = 0; piece < 20; ++piece) {
      file << "0123456789abcdef" << piece << " p" << piece << "\n" << std::flush;
      begun = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  while (!begun) std::this_thread::yield();
  const Result<std::string> text = server::read_small_file("token-file", path);
  writer.join();
  // Whole, unless the machine let the writer wait for longer than a reader can know of.
  if (text.ok()) {
    EXPECT_EQ(text.value().back(), '\n');
  } else {
    EXPECT_EQ(text.error().code, ErrorCode::kUnavailable);
  }
}

TEST_F(TlsTest, MismatchedFilesAreRefusedAtStartupAndValidOnesMayListenAnywhere) {
  using server::read_tls_files;
  EXPECT_TRUE(read_tls_files({file("daemon.pem"), file("daemon.key"), file("ca.pem")}).ok());
  EXPECT_FALSE(read_tls_files({file("daemon.pem"), "", ""}).ok());
  EXPECT_THAT(read_tls_files({file("daemon.pem"), file("carol.key"), ""}).error().message,
              HasSubstr("carol.key"));
  EXPECT_THAT(read_tls_files({file("nothing.pem"), file("carol.key"), ""}).error().message,
              HasSubstr("nothing.pem"));
  EXPECT_THAT(read_tls_files({file("daemon.pem"), file("daemon.key"), file("ca.key")}).error().message,
              HasSubstr("ca.key"));
  config_.listen = {"0.0.0.0:0"};
  start();
  EXPECT_THAT(log_text_.str(), HasSubstr("whoever reaches this address may call"));
  config_.tls = {};
  EXPECT_EQ(server::Daemon::start(config_, log_).error().code, ErrorCode::kFailedPrecondition);
}

}  // namespace
}  // namespace warmfront::test
