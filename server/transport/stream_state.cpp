// SPDX-License-Identifier: Apache-2.0
// The transitions of a StreamSteps call. Pure functions.
#include "server/transport/stream_state.h"

#include <algorithm>

namespace warmfront::server {
namespace {

void advance_to(StreamState& state, StreamCourse course) {
  state.course = std::max(state.course, course);
}

void break_off(StreamState& state) {
  advance_to(state, StreamCourse::kBroken);
  state.waiting = state.queued_bytes = 0;
}

void written(StreamState& state) {
  if (state.write == StreamWrite::kFrameEnd) --state.in_flight;
  state.write = StreamWrite::kNone;
}

/// Has everything that the client is owed been written?
/// A message that is being handled may make the session the stream's, which is given back before the end.
bool is_delivered(const StreamState& state) {
  return state.read != StreamRead::kHandling &&
         (state.course == StreamCourse::kBroken || (!is_busy(state) && state.waiting == 0));
}

bool may_begin_frame(const StreamState& state, const StreamBounds& bounds) {
  return state.in_flight < bounds.window && state.queued_bytes < bounds.max_queued_bytes;
}

}  // namespace

StreamState after(StreamState state, StreamEvent event) {
  switch (event.kind) {
    case StreamEvent::Kind::kReadStarted:
      state.read = StreamRead::kReading;
      break;
    case StreamEvent::Kind::kMessageStarted:
      state.write = StreamWrite::kMessage;
      --state.waiting;
      break;
    case StreamEvent::Kind::kPartStarted:
      state.write = StreamWrite::kPart;
      break;
    case StreamEvent::Kind::kFrameEndStarted:
      state.write = StreamWrite::kFrameEnd;
      --state.waiting;
      state.queued_bytes -= event.bytes;
      break;
    case StreamEvent::Kind::kFinishStarted:
      advance_to(state, StreamCourse::kFinished);
      break;
    case StreamEvent::Kind::kReadDone:
      state.read = StreamRead::kHandling;
      break;
    case StreamEvent::Kind::kHandled:
      state.read = StreamRead::kNone;
      break;
    case StreamEvent::Kind::kWriteDone:
      written(state);
      break;
    case StreamEvent::Kind::kWriteLost:
      written(state);
      break_off(state);
      break;
    case StreamEvent::Kind::kAttachStarted:
      state.attach = StreamAttach::kAttaching;
      state.awaiting = false;
      break;
    case StreamEvent::Kind::kPartTaken:
      state.awaiting = true;
      break;
    case StreamEvent::Kind::kFrameTaken:
      state.awaiting = false;
      ++state.in_flight;
      break;
    case StreamEvent::Kind::kAttachSettled:
      state.attach = StreamAttach::kSettled;
      break;
    case StreamEvent::Kind::kQueued:
      if (!takes_messages(state)) break;
      ++state.waiting;
      state.queued_bytes += event.bytes;
      break;
    case StreamEvent::Kind::kEnded:
      advance_to(state, StreamCourse::kEnding);
      break;
    case StreamEvent::Kind::kBroken:
      break_off(state);
      break;
    case StreamEvent::Kind::kHandlingFailed:
      state.read = StreamRead::kNone;
      [[fallthrough]];
    case StreamEvent::Kind::kFailed:
      break_off(state);
      if (state.attach == StreamAttach::kAttaching) state.attach = StreamAttach::kSettled;
      break;
  }
  return state;
}

StreamAction due(const StreamState& state, const StreamBounds& bounds) {
  if (state.course == StreamCourse::kFinished) return StreamAction::kNone;
  const bool writing = state.write != StreamWrite::kNone;
  if (takes_messages(state) && !writing && state.waiting > 0) return StreamAction::kWrite;
  if (state.course == StreamCourse::kOpen) {
    const bool may_read = state.read == StreamRead::kNone && state.attach != StreamAttach::kAttaching;
    return may_read && (state.awaiting || may_begin_frame(state, bounds)) ? StreamAction::kRead
                                                                          : StreamAction::kNone;
  }
  return !writing && is_delivered(state) ? StreamAction::kFinish : StreamAction::kNone;
}

}  // namespace warmfront::server
