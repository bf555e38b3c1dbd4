// SPDX-License-Identifier: Apache-2.0
// What the daemon logs of gRPC's own messages.
#include "server/observe/grpc_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "server/observe/repeats.h"

namespace warmfront::test {
namespace {

using ::testing::HasSubstr;

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

TEST(RepeatsTest, WordsDoNotHideOneAnotherAndAllTogetherAreFew) {
  server::Repeats repeats;
  const auto start = std::chrono::steady_clock::now();
  constexpr int kPlaces = 32;
  const auto words = [](int i) { return "words " + std::to_string(i); };
  for (int i = 0; i < kPlaces; ++i) EXPECT_EQ(repeats.admit(words(i), start), 0u) << i;
  EXPECT_FALSE(repeats.admit(words(0), start));
  EXPECT_FALSE(repeats.admit(words(3), start));
  EXPECT_FALSE(repeats.admit("one too many", start)) << "in this second";
  const auto later = start + std::chrono::seconds(1);
  EXPECT_EQ(repeats.admit("one too many", later), 2u) << "itself, and one whose place it took";
  EXPECT_EQ(repeats.admit(words(3), later), 1u);
}

}  // namespace
}  // namespace warmfront::test
