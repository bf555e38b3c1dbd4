// SPDX-License-Identifier: Apache-2.0
// Token files, and where a client sends its token.
#include "server/auth/tokens.h"

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "client/lib/client.h"
#include "tests/unit/server/local_daemon.h"
#include "tests/unit/server/three_tokens.h"
#include "warmfront/v1/collision_service.grpc.pb.h"

namespace warmfront::test {
namespace {

using client::Client;
using client::ClientOptions;
using server::Tokens;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(TokensTest, AreReadLineByLineAndErrorsDoNotQuoteThem) {
  const Tokens tokens =
      Tokens::parse(std::string("# who\n\n") + kAliceToken + " alice\r\n" + kRootToken + "  root admin\n")
          .value();
  EXPECT_EQ(tokens.size(), 2u);
  EXPECT_EQ(tokens.find(kAliceToken)->name, "alice");
  EXPECT_FALSE(tokens.find(kAliceToken)->admin);
  EXPECT_TRUE(tokens.find(kRootToken)->admin);
  EXPECT_FALSE(tokens.find(std::string(kAliceToken) + "x"));
  EXPECT_FALSE(tokens.find(""));
  for (const std::string& bad :
       {std::string("secret alice"), std::string(kAliceToken), std::string(kAliceToken) + " alice boss",
        std::string(kAliceToken) + " a\n" + kAliceToken + " b", std::string()}) {
    const auto read = Tokens::parse(bad);
    ASSERT_FALSE(read.ok()) << bad;
    EXPECT_THAT(read.error().message, Not(HasSubstr("alice-")));
  }
  EXPECT_THAT(Tokens::parse("\nsecret alice").error().message, HasSubstr("line 2"));
  for (const char* unreadable : {"/nonexistent", "/"})
    EXPECT_THAT(Tokens::read(unreadable).error().message, HasSubstr("cannot be read"));
  EXPECT_THAT(Tokens::read("/dev/null").error().message, HasSubstr("a regular file is expected"));
}

TEST(ClientSecurityTest, ATokenIsNotSentUnencryptedToAnotherHost) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "t").string();
  std::ofstream(path) << kAliceToken;
  ClientOptions options;
  options.security.token_file = path;
  const auto refused = Client::connect("warmfront.example.org:1", options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("unencrypted"));
  options.security.token_file = "/nonexistent";
  EXPECT_THAT(Client::connect("127.0.0.1:1", options).error().message, HasSubstr("/nonexistent"));
}

}  // namespace
}  // namespace warmfront::test
