// SPDX-License-Identifier: Apache-2.0
// The states of a StreamSteps call: every event in every state, and random calls.
#include "server/transport/stream_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <random>
#include <string>
#include <vector>

namespace warmfront::server {
namespace {

using Kind = StreamEvent::Kind;

constexpr StreamBounds kBounds{2, 100};
constexpr std::array kCourses{StreamCourse::kOpen, StreamCourse::kEnding, StreamCourse::kBroken,
                              StreamCourse::kFinished};
constexpr std::array kReads{StreamRead::kNone, StreamRead::kReading, StreamRead::kHandling};
constexpr std::array kWrites{StreamWrite::kNone, StreamWrite::kMessage, StreamWrite::kPart,
                             StreamWrite::kFrameEnd};
constexpr std::array kAttaches{StreamAttach::kNone, StreamAttach::kAttaching, StreamAttach::kSettled};

struct Row {
  const char* name;
  Kind event;
  bool (*possible)(const StreamState&);    // may it come in this state?
  StreamState (*expected)(StreamState s);  // in the call that is open or ending
};

bool always(const StreamState&) {
  return true;
}
bool unwritten(const StreamState& s) {
  return s.course < StreamCourse::kBroken && s.write == StreamWrite::kNone && s.waiting > 0;
}
bool writes(const StreamState& s) {
  return s.write != StreamWrite::kNone;
}
bool handles(const StreamState& s) {
  return s.read == StreamRead::kHandling;
}

StreamState broken(StreamState s) {
  s.course = std::max(s.course, StreamCourse::kBroken);
  s.waiting = 0;
  s.queued_bytes = 0;
  return s;
}

constexpr std::size_t kBytes = 60;

const Row kRows[] = {
    {"read started", Kind::kReadStarted, [](const StreamState& s) { return s.read == StreamRead::kNone; },
     [](StreamState s) {
       s.read = StreamRead::kReading;
       return s;
     }},
    {"message started", Kind::kMessageStarted, unwritten,
     [](StreamState s) {
       s.write = StreamWrite::kMessage;
       s.waiting -= 1;
       return s;
     }},
    {"part started", Kind::kPartStarted, unwritten,
     [](StreamState s) {
       s.write = StreamWrite::kPart;
       return s;
     }},
    {"end of a frame started", Kind::kFrameEndStarted,
     [](const StreamState& s) { return unwritten(s) && s.queued_bytes >= kBytes; },
     [](StreamState s) {
       s.write = StreamWrite::kFrameEnd;
       s.waiting -= 1;
       s.queued_bytes -= kBytes;
       return s;
     }},
    {"finish started", Kind::kFinishStarted, always,
     [](StreamState s) {
       s.course = StreamCourse::kFinished;
       return s;
     }},
    {"read done", Kind::kReadDone, [](const StreamState& s) { return s.read == StreamRead::kReading; },
     [](StreamState s) {
       s.read = StreamRead::kHandling;
       return s;
     }},
    {"handled", Kind::kHandled, [](const StreamState& s) { return s.read != StreamRead::kReading; },
     [](StreamState s) {
       s.read = StreamRead::kNone;
       return s;
     }},
    {"write done", Kind::kWriteDone, writes,
     [](StreamState s) {
       s.in_flight -= s.write == StreamWrite::kFrameEnd ? 1 : 0;
       s.write = StreamWrite::kNone;
       return s;
     }},
    {"write lost", Kind::kWriteLost, writes,
     [](StreamState s) {
       s.in_flight -= s.write == StreamWrite::kFrameEnd ? 1 : 0;
       s.write = StreamWrite::kNone;
       return broken(s);
     }},
    {"attach started", Kind::kAttachStarted,
     [](const StreamState& s) { return handles(s) && s.attach == StreamAttach::kNone; },
     [](StreamState s) {
       s.attach = StreamAttach::kAttaching;
       s.awaiting = false;
       return s;
     }},
    {"part taken", Kind::kPartTaken, handles,
     [](StreamState s) {
       s.awaiting = true;
       return s;
     }},
    {"frame taken", Kind::kFrameTaken, handles,
     [](StreamState s) {
       s.awaiting = false;
       s.in_flight += 1;
       return s;
     }},
    {"attach settled", Kind::kAttachSettled, always,
     [](StreamState s) {
       s.attach = StreamAttach::kSettled;
       return s;
     }},
    {"queued", Kind::kQueued, always,
     [](StreamState s) {
       if (s.course >= StreamCourse::kBroken) return s;  // nothing is delivered any more
       s.waiting += 1;
       s.queued_bytes += kBytes;
       return s;
     }},
    {"ended", Kind::kEnded, always,
     [](StreamState s) {
       if (s.course == StreamCourse::kOpen) s.course = StreamCourse::kEnding;
       return s;
     }},
    {"broken", Kind::kBroken, always, broken},
    {"handling failed", Kind::kHandlingFailed, handles,
     [](StreamState s) {
       s.read = StreamRead::kNone;
       if (s.attach == StreamAttach::kAttaching) s.attach = StreamAttach::kSettled;
       return broken(s);
     }},
    {"failed", Kind::kFailed, always,
     [](StreamState s) {
       if (s.attach == StreamAttach::kAttaching) s.attach = StreamAttach::kSettled;
       return broken(s);
     }},
};

std::string describe(const StreamState& s) {
  return "course " + std::to_string(static_cast<int>(s.course)) + " read " +
         std::to_string(static_cast<int>(s.read)) + " write " + std::to_string(static_cast<int>(s.write)) +
         " attach " + std::to_string(static_cast<int>(s.attach)) + (s.awaiting ? " awaiting" : "") +
         " in flight " + std::to_string(s.in_flight) + " waiting " + std::to_string(s.waiting) + " bytes " +
         std::to_string(s.queued_bytes);
}

/// Every state with up to two frames in flight and two messages waiting.
template <class Visit>
void for_each_state(Visit visit) {
  for (const StreamCourse course : kCourses)
    for (const StreamRead read : kReads)
      for (const StreamWrite write : kWrites)
        for (const StreamAttach attach : kAttaches)
          for (const bool awaiting : {false, true})
            for (const std::uint32_t in_flight : {0u, 1u, 2u})
              for (const std::size_t waiting : {0u, 1u, 2u})
                for (const std::size_t bytes : {std::size_t{0}, kBytes, 2 * kBytes}) {
                  if (bytes > waiting * kBytes) continue;
                  if (write == StreamWrite::kFrameEnd && in_flight == 0) continue;
                  visit(StreamState{course, read, write, attach, awaiting, in_flight, waiting, bytes});
                }
}

TEST(StreamStateTest, EveryEventInEveryStateDoesWhatItsRowSays) {
  std::size_t transitions = 0;
  for_each_state([&](const StreamState& state) {
    for (const Row& row : kRows) {
      if (!row.possible(state)) continue;
      ++transitions;
      const StreamState next = after(state, {row.event, kBytes});
      ASSERT_TRUE(next == row.expected(state))
          << row.name << " in " << describe(state) << " gives " << describe(next);
      ASSERT_GE(next.course, state.course) << row.name << " in " << describe(state);
      if (state.course != StreamCourse::kFinished) continue;
      ASSERT_EQ(due(next, kBounds), StreamAction::kNone) << row.name << " after the end, " << describe(state);
    }
  });
  EXPECT_GT(transitions, 10000u);
}

TEST(StreamStateTest, WhatIsDueNeverOverlapsWhatIsOutstanding) {
  for_each_state([](const StreamState& s) {
    const std::string where = describe(s);
    const bool room = s.in_flight < kBounds.window && s.queued_bytes < kBounds.max_queued_bytes;
    switch (due(s, kBounds)) {
      case StreamAction::kWrite:
        ASSERT_EQ(s.write, StreamWrite::kNone) << where;
        ASSERT_GT(s.waiting, 0u) << where;
        ASSERT_LT(s.course, StreamCourse::kBroken) << where << ": nothing is delivered any more";
        break;
      case StreamAction::kRead:
        ASSERT_EQ(s.read, StreamRead::kNone) << where;
        ASSERT_EQ(s.course, StreamCourse::kOpen) << where;
        ASSERT_NE(s.attach, StreamAttach::kAttaching) << where << ": its answer comes first";
        ASSERT_TRUE(s.awaiting || room) << where << ": a frame too many";
        break;
      case StreamAction::kFinish:
        ASSERT_EQ(s.write, StreamWrite::kNone) << where;
        ASSERT_TRUE(s.course == StreamCourse::kEnding || s.course == StreamCourse::kBroken) << where;
        ASSERT_NE(s.read, StreamRead::kHandling) << where << ": it may be becoming the session's stream";
        if (s.course == StreamCourse::kEnding) {
          ASSERT_EQ(s.waiting, 0u) << where;
          ASSERT_EQ(s.in_flight, 0u) << where;
          ASSERT_NE(s.attach, StreamAttach::kAttaching) << where;
        }
        break;
      case StreamAction::kNone:
        // No deadlock: whenever something waits, something else will end the wait.
        const bool outstanding = s.write != StreamWrite::kNone || s.read != StreamRead::kNone;
        ASSERT_TRUE(s.course == StreamCourse::kFinished || outstanding ||
                    s.attach == StreamAttach::kAttaching || s.in_flight > 0)
            << where;
        break;
    }
  });
}

TEST(StreamStateTest, ReadingPausesAtEachBoundAndGoesOnBelowIt) {
  StreamState state;
  state.awaiting = false;
  state.attach = StreamAttach::kSettled;
  ASSERT_EQ(due(state, kBounds), StreamAction::kRead);

  state.in_flight = kBounds.window;
  EXPECT_EQ(due(state, kBounds), StreamAction::kNone) << "as many frames in flight as the window has";
  state.write = StreamWrite::kFrameEnd;
  EXPECT_EQ(due(after(state, {Kind::kWriteDone}), kBounds), StreamAction::kRead);

  state.in_flight = 1;
  state.waiting = 1;
  state.queued_bytes = kBounds.max_queued_bytes;
  EXPECT_EQ(due(state, kBounds), StreamAction::kNone) << "answers that nobody takes";
  state.awaiting = true;
  EXPECT_EQ(due(state, kBounds), StreamAction::kRead) << "the rest of a frame is read all the same";
  state.awaiting = false;
  state.write = StreamWrite::kNone;
  state = after(state, {Kind::kFrameEndStarted, kBounds.max_queued_bytes});
  EXPECT_EQ(due(state, kBounds), StreamAction::kRead);
}

TEST(StreamStateTest, TheClientIsLateOnlyWhileItOwesWhatIsBeingRead) {
  StreamState state;
  EXPECT_FALSE(awaits_client(state)) << "nothing is being read";
  state = after(state, {Kind::kReadStarted});
  EXPECT_TRUE(awaits_client(state)) << "for the message that attaches";
  EXPECT_FALSE(awaits_client(after(state, {Kind::kReadDone})));
  EXPECT_TRUE(awaits_client(after(state, {Kind::kEnded}))) << "a later end repeats it";
  EXPECT_FALSE(awaits_client(after(state, {Kind::kBroken})));
  state.awaiting = false;
  EXPECT_FALSE(awaits_client(state)) << "between two frames a client has no time limit";
}

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
