// SPDX-License-Identifier: Apache-2.0
// The course of one StreamSteps call as a value: what is to be done next follows from what has happened, and
// from nothing else. It knows no gRPC, no session and no clock. Plain values and pure functions; whoever
// holds a state protects it (StepStream, with its mutex).
#pragma once

#include <cstddef>
#include <cstdint>

namespace warmfront::server {

/// How far the call has come. Never goes back.
enum class StreamCourse : std::uint8_t {
  kOpen,     ///< messages are read
  kEnding,   ///< no more are read; what is in hand is delivered, then the call is finished
  kBroken,   ///< nothing can be delivered any more; the call is finished as soon as no write is outstanding
  kFinished  ///< nothing is done any more
};

enum class StreamRead : std::uint8_t {
  kNone,
  kReading,  ///< a read is outstanding
  kHandling  ///< a message was read and is not yet counted in what follows from it
};

enum class StreamWrite : std::uint8_t {
  kNone,
  kMessage,   ///< a message that is no answer is being written
  kPart,      ///< a chunk of an answer that has more of them
  kFrameEnd,  ///< the last that a frame is owed
};

enum class StreamAttach : std::uint8_t {
  kNone,
  kAttaching,  ///< the session was asked, and has not answered
  kSettled     ///< it answered, or refused
};

struct StreamState {
  StreamCourse course = StreamCourse::kOpen;
  StreamRead read = StreamRead::kNone;
  StreamWrite write = StreamWrite::kNone;
  StreamAttach attach = StreamAttach::kNone;
  bool awaiting = true;         ///< the client owes the message that attaches, or the rest of a frame
  std::uint32_t in_flight = 0;  ///< frames that were read whole, the end of whose answers is not yet written
  std::size_t waiting =
      0;  ///< messages and answers that wait to be written; one begun waits until its last chunk
  std::size_t queued_bytes = 0;  ///< of the answers among them

  bool operator==(const StreamState&) const = default;
};

/// Above these no frame is begun to be read.
struct StreamBounds {
  std::uint32_t window;          ///< frames in flight
  std::size_t max_queued_bytes;  ///< of answers that wait
};

struct StreamEvent {
  enum class Kind : std::uint8_t {
    // What was begun because due() said so.
    kReadStarted,
    kMessageStarted,   ///< of the queue's front, which leaves the queue
    kPartStarted,      ///< of the answer at the front, which stays there
    kFrameEndStarted,  ///< of what is at the front, which leaves with its `bytes`
    kFinishStarted,
    // What came of it.
    kReadDone,  ///< with a message, or with the end of them
    kHandled,   ///< and all that follows from it was told
    kWriteDone,
    kWriteLost,  ///< it was not delivered, and nothing more will be
    // What the client's messages say.
    kAttachStarted,
    kPartTaken,  ///< of a frame that has more
    kFrameTaken,
    // What others say.
    kAttachSettled,
    kQueued,  ///< something to be written, an answer with `bytes`
    kEnded,   ///< by either side: a detach, a refusal, a drain, a timeout
    kBroken,  ///< cancelled, cut off, or without memory to write
    // Something was thrown; what was under way there will not tell how it went on.
    kHandlingFailed,  ///< while a message was handled
    kFailed,          ///< elsewhere: by a reply, or before the first read
  };

  Kind kind;
  std::size_t bytes = 0;  ///< of kQueued and kFrameEndStarted
};

/// The state after an event. What comes when it no longer matters changes nothing that due() looks at.
StreamState after(StreamState state, StreamEvent event);

enum class StreamAction : std::uint8_t {
  kNone,
  kWrite,  ///< the queue's front, or its next chunk
  kRead,
  kFinish  ///< give the session back, then end the call
};

/// What is to be done now. To be asked again after each event, and after what was begun: at most one read and
/// one write are outstanding, and the call is finished once, with no write outstanding.
StreamAction due(const StreamState& state, const StreamBounds& bounds);

/// May anything still be queued to be written?
inline bool takes_messages(const StreamState& state) {
  return state.course < StreamCourse::kBroken;
}

/// Is the client late when nothing comes from it?
inline bool awaits_client(const StreamState& state) {
  return takes_messages(state) && state.awaiting && state.read == StreamRead::kReading;
}

/// Is something in hand behind which more may wait unread?
inline bool is_busy(const StreamState& state) {
  return state.in_flight > 0 || state.attach == StreamAttach::kAttaching;
}

}  // namespace warmfront::server
