// SPDX-License-Identifier: Apache-2.0
// The states of a StreamSteps call: every event in every state.
#include "server/transport/stream_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "tests/unit/server/stream_state_fixture.h"

namespace warmfront::server {
namespace {

using Kind = StreamEvent::Kind;
using stream_states::describe;
using stream_states::kBounds;
using stream_states::kBytes;

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

}  // namespace
}  // namespace warmfront::server
