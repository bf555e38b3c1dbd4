// SPDX-License-Identifier: Apache-2.0
// TLS: certificates of the daemon and of clients, what is refused at start, and files that are replaced.
#include "server/auth/tls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "client/lib/client.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/moving_grids.h"
#include "tests/unit/server/open_grids.h"
#include "tests/unit/server/test_certificates.h"

namespace warmfront::test {
namespace {

using client::Client;
using client::ClientOptions;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kAlice = "alice-0123456789abcdef";

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
  EXPECT_TRUE(open_grids(client.value()).ok());
  const Result<Client> wrong = connect("wrong.pem");
  EXPECT_EQ(wrong.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(wrong.error().message, HasSubstr("is that the CA that signed its certificate"));
  const Result<Client> no_pem = connect("wrong.key");
  EXPECT_EQ(no_pem.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(no_pem.error().message, HasSubstr("has no CERTIFICATE in PEM format"));
  const Result<Client> plain = connect("");
  EXPECT_EQ(plain.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(plain.error().message, HasSubstr("does it want TLS? Then give its CA"));
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
  auto session = open_grids(carol.value());
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
  const client::Session at_home = open_grids(by_socket).value();
  EXPECT_TRUE(local.list_sessions().value().empty());
  Client carol = connect("ca.pem", "carol").value(), host = connect("ca.pem", "host").value();
  Client workload = connect("ca.pem", "workload").value(), dave = connect("ca.pem", "dave").value();
  const client::Session of_carol = open_grids(carol).value(), of_host = open_grids(host).value(),
                        of_workload = open_grids(workload).value();
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
  EXPECT_EQ(server::Daemon::start(config_, log_).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace warmfront::test
