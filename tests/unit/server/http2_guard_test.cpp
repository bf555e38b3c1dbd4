// SPDX-License-Identifier: Apache-2.0
// The HTTP/2 guard: attacks are recognised however their bytes are split, and what clients send
// passes.
#include "server/process/http2_guard.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <random>
#include <thread>

#include "tests/faults/raw_socket.h"
#include "tests/unit/server/bare_client.h"
#include "tests/unit/server/http2_guard_pieces.h"
#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {
namespace {

using namespace std::string_literals;
using http2_pieces::as_bytes;
using http2_pieces::call;
using http2_pieces::kBlockBytes;
using http2_pieces::kMetadataBytes;
using http2_pieces::kPath;
using http2_pieces::new_guard;
using http2_pieces::time_now;
using http2_pieces::told_in_pieces;
using server::Http2Guard;
using Verdict = Http2Guard::Verdict;

/// The verdict however the bytes are cut: into two anywhere when they are few, into single ones, at random.
void expect_verdict(const std::string& bytes, Verdict expected, const char* what) {
  const auto expect_name = [&](Verdict verdict, const char* cut) {
    EXPECT_STREQ(Http2Guard::kNames[verdict], Http2Guard::kNames[expected]) << what << ", " << cut;
  };
  expect_name(told_in_pieces(bytes, [] { return std::size_t{1} << 30; }), "whole");
  expect_name(told_in_pieces(bytes, [] { return std::size_t{1}; }), "byte by byte");
  std::mt19937 random(1);
  for (int round = 0; round < 5; ++round)
    expect_name(told_in_pieces(bytes, [&] { return std::size_t{1} + random() % 40; }), "at random");
  if (bytes.size() > 2000) return;
  for (std::size_t cut = 1; cut < bytes.size(); ++cut) {
    bool first = true;
    const Verdict verdict =
        told_in_pieces(bytes, [&] { return std::exchange(first, false) ? cut : std::size_t{1} << 30; });
    expect_name(verdict, "cut once");
  }
}

std::string times(std::size_t count, const std::string& bytes) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += bytes;
  return all;
}

/// HEADERS with these bytes as their fields.
std::string fields(const std::string& block, std::uint8_t flags = 5) {
  return http2::hello() + http2::frame(1, flags, 1, block);
}

TEST(Http2GuardTest, CallsPassInAnySegmentation) {
  expect_verdict(http2::hello() + call(1) + http2::frame(0, 1, 1, std::string(5, '\0')), Http2Guard::kGood,
                 "a call");
  expect_verdict(http2::hello() + call(1, {{"large", std::string(60'000, 'x')}, {"empty", ""}}) +
                     http2::ping() + call(3) + http2::reset_stream(3),
                 Http2Guard::kGood, "large metadata");
  expect_verdict(
      http2::hello() +
          http2::frame(1, 0x25, 1, "\0\0\0\0\x10"s + http2::header_block(http2::call_headers(kPath))),
      Http2Guard::kGood, "a priority in it");
  // Every way to write a field: indexed, to be indexed, never, with a long index, a table's size.
  expect_verdict(fields("\x3f\xe1\x1f"
                        "\x82"
                        "\xff\x01"
                        "\x40\x01"
                        "a\x01"
                        "b"
                        "\x7f\x05\x01"
                        "c"
                        "\x1f\x02\x00"
                        "\x0f\x80\x01\x01"
                        "d"s) +
                     http2::ping(),
                 Http2Guard::kGood, "all kinds of fields");
  expect_verdict("\x16\x03\x01 anything"s, Http2Guard::kGood, "TLS, which is another's");
}

TEST(Http2GuardTest, EachAttackIsRecognised) {
  const std::string hello = http2::hello();
  expect_verdict("GET / HTTP/1.1\r\n\r\n", Http2Guard::kPreface, "HTTP/1");
  expect_verdict("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\r" + call(1), Http2Guard::kPreface, "nearly a preface");

  const std::string part = http2::header_block({{"more", std::string(8000, 'm')}});
  expect_verdict(hello + http2::frame(1, 0, 1, part) + times(20, http2::frame(9, 0, 1, part)),
                 Http2Guard::kHeaderBlock, "CONTINUATION without end");
  expect_verdict(hello + http2::frame(1, 0, 1, "") + times(20, http2::frame(9, 0, 1, "")),
                 Http2Guard::kHeaderBlock, "empty CONTINUATION without end");
  expect_verdict(hello + http2::frame(1, 4, 1, std::string(kBlockBytes + 1, '\x82')),
                 Http2Guard::kHeaderBlock, "a large frame of fields");
  expect_verdict(fields(std::string(kBlockBytes / 32 + 1, '\x82')), Http2Guard::kHeaderBlock,
                 "a byte for each of many fields");
  expect_verdict(fields("\x40\x01"
                        "a\x7f\xff\xff\xff\x0f"s),
                 Http2Guard::kHeaderBlock, "a string of which only the length comes");

  expect_verdict(fields("\xff" + std::string(5, '\x80') + "\x01"), Http2Guard::kFieldCoding, "a long index");
  expect_verdict(fields("\x3f" + std::string(1000, '\x80'), 0), Http2Guard::kFieldCoding,
                 "a long table size");
  expect_verdict(fields("\x40\x01"
                        "a\x7f" +
                            std::string(100, '\xff'),
                        0),
                 Http2Guard::kFieldCoding, "a long length");
  expect_verdict(fields("\x40\x05"
                        "abc"s),
                 Http2Guard::kFieldCoding, "a field that is cut off");

  expect_verdict(hello + http2::frame(1, 0, 1, "\x82") + http2::ping(), Http2Guard::kFrameOrder,
                 "a frame within a block");
  expect_verdict(hello + http2::frame(9, 4, 1, "\x82"), Http2Guard::kFrameOrder, "CONTINUATION of nothing");
  expect_verdict(hello + http2::frame(1, 0xd, 1, "\0\x82"s), Http2Guard::kFrameOrder, "padding");

  const std::string known = hello + http2::acknowledgement();
  std::string resets = known;
  for (std::uint32_t i = 0; i < 1001; ++i) resets += call(2 * i + 1) + http2::reset_stream(2 * i + 1);
  expect_verdict(resets, Http2Guard::kResets, "calls that are reset at once");
  std::string at_first;
  for (std::uint32_t i = 0; i < 129; ++i) at_first += call(2 * i + 1);
  expect_verdict(hello + at_first, Http2Guard::kCalls, "calls before the settings are acknowledged");
  expect_verdict(known + at_first, Http2Guard::kGood, "calls after that");
  expect_verdict(hello + times(50'001, http2::frame(1, 5, 1, "\x82")), Http2Guard::kCalls, "calls");
  expect_verdict(hello + times(10'001, http2::ping()), Http2Guard::kPings, "pings");
  expect_verdict(hello + times(201, http2::frame(4, 0, 0, "")), Http2Guard::kSettings, "settings");
  expect_verdict(hello + http2::frame(4, 0, 0, std::string(16380, '\0')), Http2Guard::kSettings,
                 "settings of thousands");
  expect_verdict(hello + times(50'001, http2::frame(8, 0, 0, "\0\0\0\1"s)), Http2Guard::kWindowUpdates,
                 "windows");
  expect_verdict(hello + times(50'001, http2::frame(0, 0, 1, "x")), Http2Guard::kSmallData, "data of a byte");
  const std::string a_little(31, 'x');
  expect_verdict(hello + times(50'001, http2::frame(0, 0, 1, a_little)), Http2Guard::kSmallData,
                 "a little data");
  expect_verdict(hello + times(50'001, http2::frame(0, 0, 1, a_little + "x")), Http2Guard::kGood,
                 "enough data");
  expect_verdict(hello + times(1'001, http2::frame(0, 0, 1, "")), Http2Guard::kEmptyData, "data of nothing");
  for (const std::uint8_t type : {2, 5, 7, 11, 200})
    expect_verdict(hello + times(101, http2::frame(type, 0, 1, "12345")), Http2Guard::kOtherFrames, "others");
}

TEST(Http2GuardTest, SlowTrafficPassesAndAHeaderBlockHasATimeLimit) {
  time_now = Http2Guard::Clock::now();
  Http2Guard guard = new_guard();
  EXPECT_EQ(guard.receive(as_bytes(http2::hello() + http2::acknowledgement())), Http2Guard::kGood);
  std::uint32_t stream = 1;
  // A minute of 190 resets a second.
  for (int tick = 0; tick < 600; ++tick, time_now += std::chrono::milliseconds(100))
    for (int i = 0; i < 19; ++i, stream += 2)
      ASSERT_EQ(guard.receive(as_bytes(call(stream) + http2::reset_stream(stream))), Http2Guard::kGood)
          << tick;
  int more = 0;
  while (guard.receive(as_bytes(http2::reset_stream(1))) == Http2Guard::kGood) ++more;
  EXPECT_LE(more, 2000);

  for (const int seconds : {9, 11}) {
    Http2Guard slow = new_guard();
    ASSERT_EQ(slow.receive(as_bytes(http2::hello() + http2::frame(1, 0, 1, "\x82"))), Http2Guard::kGood);
    time_now += std::chrono::seconds(seconds);
    EXPECT_EQ(slow.receive(as_bytes(http2::frame(9, 4, 1, "\x82"))),
              seconds < 10 ? Http2Guard::kGood : Http2Guard::kSlowHeaders);
  }
}

/// Hands on what comes on one connection to a port, and keeps what the client sent.
class RecordingRelay {
 public:
  explicit RecordingRelay(const std::string& socket_path) : path_(socket_path) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    socklen_t length = sizeof address;
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { relay(); });
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  /// Once the client has closed.
  const std::string& sent() {
    if (thread_.joinable()) thread_.join();
    return sent_;
  }
  ~RecordingRelay() {
    sent();
    close(listener_);
  }

 private:
  void relay() {
    const int client = accept(listener_, nullptr, nullptr);
    const int server = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    path_.copy(to.sun_path, sizeof to.sun_path - 1);
    EXPECT_EQ(connect(server, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    std::array<char, 65536> block;
    for (bool open = true; open;) {
      std::array<pollfd, 2> both{{{client, POLLIN, 0}, {server, POLLIN, 0}}};
      if (poll(both.data(), 2, 20'000) == 0) break;
      for (int i = 0; i < 2 && open; ++i) {
        if (both[i].revents == 0) continue;
        const ssize_t got = read(both[i].fd, block.data(), block.size());
        open = got > 0;
        if (i == 0 && open) sent_.append(block.data(), static_cast<std::size_t>(got));
        for (ssize_t at = 0; at < got;) {
          const ssize_t put =
              send(both[1 - i].fd, block.data() + at, static_cast<std::size_t>(got - at), MSG_NOSIGNAL);
          if (put <= 0) return;
          at += put;
        }
      }
    }
    close(client);
    close(server);
  }

  const std::string path_;
  int listener_ = -1;
  int port_ = 0;
  std::string sent_;
  std::thread thread_;
};

class HonestClient : public ::testing::Test, protected BareClient {};

TEST_F(HonestClient, TrafficOfARealClientPassesEvenWithoutPauses) {
  const LocalDaemon daemon;
  RecordingRelay relay(daemon.address().substr(5));
  connect(relay.address());
  ASSERT_TRUE(create().ok());
  for (std::uint64_t frame = 1; frame <= 200; ++frame) ASSERT_TRUE(step(frame, this->frame(frame)).ok());
  for (int i = 0; i < 200; ++i) {  // given up at once
    grpc::ClientContext context;
    v1::CheckSessionRequest request;
    request.set_session_id(kId);
    v1::CheckSessionResponse response;
    context.TryCancel();
    static_cast<void>(stub_->CheckSession(&context, request, &response));
  }
  for (int i = 0; i < 50; ++i) expect_healthy();
  {
    grpc::ClientContext large;
    large.AddMetadata("large", std::string(12'000, 'l'));
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&large, {}, &info).ok());
  }
  stub_.reset();
  channel_.reset();
  const std::string& sent = relay.sent();
  EXPECT_GT(sent.size(), 100'000u);
  expect_verdict(sent, Http2Guard::kGood, "a real client's traffic");
}

// Not asserted: the cost of inspecting traffic.
TEST(Http2GuardTest, CostOfInspection) {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += http2::frame(0, 0, 1, std::string(16384, 'd'));
  Http2Guard guard({.max_metadata_bytes = kMetadataBytes});
  guard.receive(as_bytes(http2::hello()));
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t at = 0; at < bytes.size(); at += 8192)
    ASSERT_EQ(guard.receive(as_bytes(std::string_view(bytes).substr(at, 8192))), Http2Guard::kGood);
  const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
  std::printf("%.1f ns for each 16 KiB frame in pieces of 8 KiB\n", took.count() / 1000);
}

}  // namespace
}  // namespace warmfront::test
