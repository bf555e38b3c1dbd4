// SPDX-License-Identifier: Apache-2.0
// The HTTP/2 guard resets calls that stay without a message, between two frames, and no others.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "server/process/http2_guard.h"
#include "tests/faults/raw_socket.h"
#include "tests/unit/server/bare_client.h"
#include "tests/unit/server/http2_guard_pieces.h"

namespace warmfront::test {
namespace {

using namespace std::string_literals;
using http2_pieces::as_bytes;
using http2_pieces::call;
using http2_pieces::standing_clock;
using http2_pieces::time_now;
using server::Http2Guard;
using Verdict = Http2Guard::Verdict;

/// A guard that reads as gRPC does: what it passes on, and whether it searched for a frame's end.
class ReadingGuard {
 public:
  static constexpr std::chrono::seconds kPatience{10};
  static constexpr std::uint32_t kStreams = 4;

  ReadingGuard() { read(http2::hello() + http2::acknowledgement()); }

  /// What gRPC would be given, in reads of `space` bytes at most.
  std::string read(std::string_view bytes, std::size_t space = 8192) {
    std::string all;
    while (!bytes.empty() && guard_.verdict() == Http2Guard::kGood) {
      Http2Guard::NextRead next{0, space};
      if (guard_.has_silent_calls()) next = guard_.next_read(space);
      EXPECT_LE(next.resets + next.most, space);
      EXPECT_GT(next.most, 0u);
      const std::string_view came = bytes.substr(0, next.most);
      std::string resets(next.resets, '\0');
      guard_.write_resets({reinterpret_cast<std::uint8_t*>(resets.data()), resets.size()});
      guard_.receive(as_bytes(came));
      all.append(resets).append(came);
      bytes.remove_prefix(came.size());
    }
    return all;
  }
  Verdict verdict() const { return guard_.verdict(); }
  bool has_silent_calls() const { return guard_.has_silent_calls(); }

 private:
  Http2Guard guard_{{.max_streams = kStreams, .first_message = kPatience}, &standing_clock};
};

const std::string kWindow = http2::frame(8, 0, 0, "\0\0\0\1"s);

TEST(Http2GuardTest, CallsWithoutAMessageAreResetAfterTheirTimeBetweenTwoFrames) {
  time_now = Http2Guard::Clock::now();
  // Nothing is inserted within a frame: a read ends where the frame does.
  const std::string more = http2::ping() + kWindow;
  for (const std::size_t cut : {1u, 8u, 9u, 12u}) {
    ReadingGuard other;
    time_now += std::chrono::seconds(1);
    other.read(call(1) + more.substr(0, cut));
    time_now += std::chrono::seconds(11);
    EXPECT_EQ(other.read(more.substr(cut)), http2::ping().substr(cut) + http2::reset_stream(1) + kWindow);
    EXPECT_FALSE(other.has_silent_calls());
  }
}

TEST(Http2GuardTest, TheTimeOfEachCallCounts) {
  time_now = Http2Guard::Clock::now();
  ReadingGuard guard;
  guard.read(call(1) + call(3));
  time_now += std::chrono::seconds(6);
  guard.read(call(5));
  time_now += std::chrono::seconds(5);
  EXPECT_EQ(guard.read(kWindow), http2::reset_stream(1) + http2::reset_stream(3) + kWindow);
  EXPECT_EQ(guard.read(kWindow), kWindow);
  time_now += std::chrono::seconds(6);
  // What does not fit in one read comes with the next.
  EXPECT_EQ(guard.read(kWindow, 13), kWindow) << "nothing but frames of ours is no read";
  EXPECT_EQ(guard.read(kWindow, 14).substr(0, 13), http2::reset_stream(5));
}

TEST(Http2GuardTest, CallsWithAMessageOrAnEndAreLeftAlone) {
  const std::string message =
      "\0\0\0\0\x03"
      "abc"s;
  const std::vector<std::string> calls{
      call(1) + http2::frame(0, 0, 1, message),
      call(1) + http2::frame(0, 0, 1, message + "more"),
      call(1) + http2::frame(0, 0, 1, message.substr(0, 2)) + http2::ping() +
          http2::frame(0, 0, 1, message.substr(2)),
      call(1) + http2::frame(0, 0, 1, message.substr(0, 6)) + http2::frame(0, 0, 1, message.substr(6)),
      call(1) + http2::frame(0, 0, 1, std::string(5, '\0')),
      call(1) + http2::frame(0, 1, 1, "\0"s),
      call(1) + http2::frame(0, 1, 1, ""),
      call(1) + http2::reset_stream(1),
      call(1) + http2::frame(1, 5, 1, "\x82"),
      http2::frame(1, 5, 1, "\x82"),
      call(2),                                             // gRPC overlooks it
      call(3) + http2::frame(0, 1, 3, message) + call(1),  // likewise
  };
  for (const std::string& bytes : calls)
    for (const std::size_t space : {1u, 7u, 8192u}) {
      time_now = Http2Guard::Clock::now();
      ReadingGuard guard;
      EXPECT_EQ(guard.read(bytes, space), bytes);
      EXPECT_FALSE(guard.has_silent_calls());
      time_now += std::chrono::hours(1);
      EXPECT_EQ(guard.read(kWindow), kWindow);
    }
  // With more than its time in between, it is too late for the message.
  time_now = Http2Guard::Clock::now();
  ReadingGuard guard;
  guard.read(calls[0].substr(0, calls[0].size() - 1));
  time_now += std::chrono::seconds(11);
  EXPECT_EQ(guard.read("c" + kWindow), "c" + kWindow) << "the frame's last byte was the message's";
}

TEST(Http2GuardTest, AnEndlessFrameDoesNotKeepSilentCallsOpen) {
  for (const std::uint8_t end_stream : {0, 1}) {
    time_now = Http2Guard::Clock::now();
    ReadingGuard guard;
    const std::string frame = http2::frame(0, end_stream, 1, "\0\0\0\x30\0"s + std::string(9000, 'x'));
    guard.read(call(1) + frame.substr(0, 100));
    std::size_t at = 100;
    for (; guard.verdict() == Http2Guard::kGood && at < 200; ++at) {
      time_now += std::chrono::seconds(1);
      guard.read(frame.substr(at, 1));
    }
    EXPECT_STREQ(Http2Guard::kNames[guard.verdict()], "silent_calls");
    EXPECT_EQ(at, 121u) << "after 21 seconds";
  }
}

TEST(Http2GuardTest, TheOldestSilentCallsBeyondTheLimitAreReset) {
  time_now = Http2Guard::Clock::now();
  ReadingGuard guard;
  std::string calls;
  for (std::uint32_t stream = 1; stream < 13; stream += 2) calls += call(stream);
  guard.read(calls);
  EXPECT_EQ(guard.read(kWindow), http2::reset_stream(1) + http2::reset_stream(3) + kWindow);
  for (std::uint32_t stream = 13; stream < 23; stream += 2) guard.read(call(stream));
  EXPECT_EQ(guard.verdict(), Http2Guard::kGood);
  calls.clear();
  for (std::uint32_t stream = 23; stream < 33; stream += 2) calls += call(stream);
  guard.read(calls);
  EXPECT_STREQ(Http2Guard::kNames[guard.verdict()], "silent_calls") << "more than twice as many";
}

}  // namespace
}  // namespace warmfront::test
