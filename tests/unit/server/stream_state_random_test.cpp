// SPDX-License-Identifier: Apache-2.0
// Random StreamSteps calls.
#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <random>

#include "server/transport/stream_state.h"
#include "tests/unit/server/stream_state_fixture.h"

namespace warmfront::server {
namespace {

using Kind = StreamEvent::Kind;
using stream_states::describe;
using stream_states::kBounds;
using stream_states::kBytes;

/// A call whose client, session and transport do anything that they may, at random. It carries out what is
/// due, and reports forbidden states.
class RandomCall {
 public:
  explicit RandomCall(std::uint64_t seed) : random_(seed) { advance(); }

  void run(int events) {
    for (int i = 0; i < events; ++i) {
      happen();
      advance();
      check();
    }
    // However it went: the client leaves, the session and the transport answer what they owe.
    for (int i = 0; i < 1000 && state_.course != StreamCourse::kFinished; ++i) {
      settle();
      advance();
      check();
    }
    EXPECT_EQ(finishes_, 1) << describe(state_);
  }

 private:
  struct Item {
    std::size_t bytes;
    int parts;  // still to be written, 0 for a message
  };

  bool chance(int one_in) { return random_() % static_cast<std::uint64_t>(one_in) == 0; }
  void tell(Kind kind, std::size_t bytes = 0) { state_ = after(state_, {kind, bytes}); }

  void queue(Item item) {
    if (takes_messages(state_)) {
      queue_.push_back(item);
      queued_ += item.bytes;
    }
    tell(Kind::kQueued, item.bytes);
  }
  void lose_queue() {
    queue_.clear();
    queued_ = 0;
  }

  void happen() {
    switch (random_() % 12) {
      case 0:
      case 1:
        return read_done();
      case 2:
      case 3:
        return handled();
      case 4:
      case 5:
        return write_done();
      case 6:
      case 7:
        return answer();
      case 8:
        return settle_attach();
      case 9:
        if (chance(4)) queue({0, 0});  // it drains
        return;
      case 10:
        if (chance(30)) tell(Kind::kEnded);
        return;
      case 11:
        if (!chance(60)) return;
        if (handling_ && chance(2)) {
          handling_ = false;
          tell(Kind::kHandlingFailed);
        } else {
          tell(chance(2) ? Kind::kBroken : Kind::kFailed);
        }
        return lose_queue();
    }
  }

  void settle() {
    tell(Kind::kEnded);
    read_done();
    handled();
    write_done();
    answer();
    settle_attach();
  }

  void read_done() {
    if (!reading_) return;
    reading_ = false;
    handling_ = true;
    tell(Kind::kReadDone);
  }

  void handled() {
    if (!handling_) return;
    handling_ = false;
    if (state_.attach == StreamAttach::kNone) {
      tell(Kind::kAttachStarted);
      attaching_ = true;
    } else if (chance(20)) {
      tell(Kind::kEnded);
    } else if (chance(3)) {
      tell(Kind::kPartTaken);
    } else {
      tell(Kind::kFrameTaken);
      ++computing_;
      ++frames_;
    }
    if (state_.course < StreamCourse::kBroken) {
      // What was read beyond the bounds was the rest of a frame.
      EXPECT_LE(state_.in_flight, kBounds.window);
    }
    tell(Kind::kHandled);
  }

  void answer() {
    if (computing_ == 0) return;
    --computing_;
    if (chance(4))
      queue({0, 1});  // an error
    else
      queue({kBytes, 1 + static_cast<int>(random_() % 3)});
  }

  void settle_attach() {
    if (!attaching_) return;
    attaching_ = false;
    tell(Kind::kAttachSettled);
    if (chance(10))
      tell(Kind::kEnded);
    else
      queue({0, 0});
  }

  void write_done() {
    if (!writing_) return;
    writing_ = false;
    if (chance(100)) {
      tell(Kind::kWriteLost);
      lose_queue();
    } else {
      tell(Kind::kWriteDone);
    }
  }

  void advance() {
    for (;;) {
      const StreamAction action = due(state_, kBounds);
      if (action == StreamAction::kNone) return;
      ASSERT_EQ(finishes_, 0) << "nothing after the end";
      if (action == StreamAction::kRead) {
        ASSERT_FALSE(reading_ || handling_) << "one read";
        reading_ = true;
        tell(Kind::kReadStarted);
      } else if (action == StreamAction::kWrite) {
        ASSERT_FALSE(writing_) << "one write";
        ASSERT_FALSE(queue_.empty());
        if (chance(200)) {  // no memory for it
          tell(Kind::kEnded);
          tell(Kind::kBroken);
          lose_queue();
        } else {
          write();
        }
      } else {
        ASSERT_FALSE(writing_);
        const bool delivered = queue_.empty() && computing_ == 0 && !attaching_ && !handling_;
        ASSERT_TRUE(state_.course == StreamCourse::kBroken || delivered) << "what was in progress";
        ++finishes_;
        tell(Kind::kFinishStarted);
      }
    }
  }

  void write() {
    writing_ = true;
    Item& item = queue_.front();
    if (item.parts > 1) {
      --item.parts;
      return tell(Kind::kPartStarted);
    }
    tell(item.parts == 0 ? Kind::kMessageStarted : Kind::kFrameEndStarted, item.bytes);
    queued_ -= item.bytes;
    queue_.pop_front();
  }

  void check() const {
    EXPECT_EQ(state_.waiting, queue_.size());
    EXPECT_EQ(state_.queued_bytes, queued_);
    EXPECT_EQ(state_.read == StreamRead::kReading, reading_);
    EXPECT_EQ(state_.write != StreamWrite::kNone, writing_);
    EXPECT_LE(state_.in_flight, frames_);
    if (is_busy(state_) || !takes_messages(state_)) return;
    EXPECT_EQ(computing_, 0u);
  }

  std::mt19937_64 random_;
  StreamState state_;
  std::deque<Item> queue_;
  std::size_t queued_ = 0;
  std::uint32_t frames_ = 0, computing_ = 0;
  bool reading_ = false, handling_ = false, writing_ = false, attaching_ = false;
  int finishes_ = 0;
};

TEST(StreamStateTest, RandomCallsKeepTheRulesAndFinishOnce) {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    SCOPED_TRACE(seed);
    RandomCall(seed).run(400);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace warmfront::server
