// SPDX-License-Identifier: Apache-2.0
// Fault table, rows 14 to 17 and 24: messages too large, compressed, or none at all; and what HTTP/2 lets a
// client do.
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "tests/faults/fault_table.h"
#include "tests/faults/raw_socket.h"

namespace warmfront::test {
namespace {

using grpc::StatusCode;

TEST_F(FaultTable, Row14_MessageOverTheLimit) {
  ASSERT_TRUE(create().ok());
  // Of 256 MiB, four times what the transport may hold, as much comes in as it may hold; it stays with the
  // allocator for a second or two.
  allowed_peak_ = 128 * kMiB;
  const std::string huge = frame_message(1, std::string(256 * kMiB, 'x')).SerializeAsString();
  const auto expect_refused = [this](const char* method, const std::vector<std::string>& messages) {
    EXPECT_EQ(raw_call(method, messages).error_code(), StatusCode::RESOURCE_EXHAUSTED) << method;
    if (kSanitized) return;
    EXPECT_LE(growth_once_within(allowed_growth_), allowed_growth_) << "after " << method;
  };
  expect_refused("StreamSteps", {attach(kId).SerializeAsString(), huge});
  expect_refused("Step", {huge});
  expect_refused("CreateSession", {huge});
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(FaultTable, Row15_CompressedMessage) {
  ASSERT_TRUE(create().ok());
  // 64 MiB of zeros, 64 KiB on the wire.
  const std::string bomb = frame_message(1, std::string(64 * kMiB, '\0')).SerializeAsString();
  for (const char* method : {"Step", "CreateSession", "StreamSteps"})
    EXPECT_EQ(raw_call(method, {bomb}, true).error_code(), StatusCode::UNIMPLEMENTED) << method;
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(FaultTable, Row16_BytesThatAreNoMessage) {
  ASSERT_TRUE(create().ok());
  std::mt19937 random(7);
  const std::string whole = frame_message(1, std::string(40, 'p')).SerializeAsString();
  int tried = 0;
  for (int round = 0; round < 100; ++round) {
    std::string garbage =
        whole.substr(0, whole.size() - 1 - static_cast<std::size_t>(round) % (whole.size() - 1));
    if (round % 2 == 0) {
      // A wire type that does not exist, and noise.
      garbage.assign(1 + random() % 200, '\x07');
      for (std::size_t i = 1; i < garbage.size(); ++i) garbage[i] = static_cast<char>(random());
    }
    expect_fault(raw_call("StreamSteps", {attach(kId, true).SerializeAsString(), garbage}),
                 StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID_INPUT, "bytes are no");
    EXPECT_EQ(raw_call("CreateSession", {garbage}).error_code(), StatusCode::INVALID_ARGUMENT);
    // A unary call of large messages too.
    EXPECT_EQ(raw_call("Step", {"\x07" + garbage}).error_code(), StatusCode::INVALID_ARGUMENT);
    tried += 3;
  }
  // An id that is no UTF-8 is no message either.
  EXPECT_EQ(raw_call("StreamSteps", {"\x12\x04\x0a\x02\xff\xfe"}).error_code(), StatusCode::INVALID_ARGUMENT);
  std::printf("%d messages that are none\n", tried);
  // Whatever clients send, the log holds whole events and nothing else.
  std::istringstream log(daemon_->log());
  for (std::string line; std::getline(log, line);) EXPECT_TRUE(nlohmann::json::accept(line)) << line;
  EXPECT_TRUE(step(1, frame(1)).ok());
}

TEST_F(FaultTable, Row17_UnknownMethod) {
  for (const char* method : {"NoSuchMethod", "", "stepsession", "StreamSteps/x"})
    EXPECT_EQ(raw_call(method, {"x"}).error_code(), StatusCode::UNIMPLEMENTED) << method;
}

TEST_F(FaultTable, Row24_HeadersWithoutEnd) {
  const std::string path = "/warmfront.v1.CollisionService/StreamSteps";
  const int port = daemon_->port();
  const auto attack = [&](const http2::Headers& more) {
    const RawSocket socket(port);
    ASSERT_TRUE(socket.connected());
    socket.send(http2::hello() + http2::headers(1, http2::call_headers(path, more)));
    socket.read_all(300);
    step_untouched();
  };
  attack({{"huge", std::string(kMiB, 'h')}});
  http2::Headers many;
  for (int i = 0; i < 1000; ++i) many.emplace_back("name-" + std::to_string(i), std::string(100, 'v'));
  attack(many);
  attack({{"broken-bin", "this is no base64!"}, {"other-bin", "===="}});
  attack({{"Upper-Case", "x"}, {"", ""}, {":path", "/twice"}});
  // A block that never ends: CONTINUATION after CONTINUATION.
  const RawSocket endless(port);
  endless.send(http2::hello() + http2::frame(1, 0, 1, http2::header_block(http2::call_headers(path))));
  for (int i = 0; i < 2000 && endless.send(http2::frame(
                                  9, 0, 1, http2::header_block({{"more", std::string(8000, 'm')}})));
       ++i) {
  }
  step_untouched();
}

TEST_F(FaultTable, Row24_PingFloodAndRapidReset) {
  // gRPC 1.51 does not limit clients that open and reset streams at once (CVE-2023-44487): the guard before
  // it ends both connections, and what was begun until then costs some 18 KiB a call.
  allowed_peak_ = 256 * kMiB;
  const int port = daemon_->port();
  const RawSocket pinging(port), resetting(port);
  ASSERT_TRUE(pinging.send(http2::hello()) && resetting.send(http2::hello()));
  std::string pings, resets;
  int sent = 0;
  for (int i = 0; i < 1000; ++i) pings += http2::ping();
  for (int round = 0; round < 20; ++round) {
    if (!pinging.send(pings)) break;
    sent += 1000;
  }
  std::uint32_t stream = 1;
  for (int round = 0; round < 100; ++round) {
    resets.clear();
    for (int i = 0; i < 100; ++i, stream += 2)
      resets += http2::headers(stream, http2::call_headers("/warmfront.v1.CollisionService/StreamSteps")) +
                http2::reset_stream(stream);
    if (!resetting.send(resets)) break;
    if (round % 20 == 0) step_untouched();
  }
  std::printf("%d pings and %u streams reset at once were taken before a cut\n", sent, stream / 2);
  step_untouched();
}

TEST_F(FaultTable, Row24_NoHttp2AtAll) {
  const int port = daemon_->port();
  std::mt19937 random(11);
  for (int round = 0; round < 50; ++round) {
    const RawSocket socket(port);
    std::string noise = round % 3 == 0   ? "GET / HTTP/1.1\r\nHost: x\r\n\r\n"
                        : round % 3 == 1 ? http2::hello()
                                         : "";
    for (int i = 0; i < 500; ++i) noise += static_cast<char>(random());
    socket.send(noise);
  }
  step_untouched();
}

}  // namespace
}  // namespace warmfront::test
