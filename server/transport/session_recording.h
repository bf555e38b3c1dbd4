// SPDX-License-Identifier: Apache-2.0
// What went over the wire to one session, on its way into a file (proto/recording/README.md). Used by one
// thread at a time: by the upload, then by the session's jobs.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "server/session/session.h"
#include "server/transport/recording_disk.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// A frame's parts as they came, which wait with it for their turn. Used by one thread at a time.
class RecordedParts {
 public:
  /// What is kept is charged to `account`, which may be null.
  explicit RecordedParts(std::shared_ptr<Account> account) : memory_(std::move(account)) {}

  /// Parts that hold more than `most` bytes together are not kept, and the recording stops in the frame's
  /// turn: a client could send them for ever.
  void add(v1::StepFrame part, std::size_t most);
  /// The bound of those that came in one message, which has its own.
  static constexpr std::size_t kOneMessage = std::numeric_limits<std::size_t>::max();

 private:
  friend class SessionRecording;
  std::vector<v1::StepFrame> parts_;
  Holding memory_;
  bool too_large_ = false;
};

/// Nothing here fails or waits for a disk: a recording that cannot go on stops, and the session goes on.
class SessionRecording final : public SessionCompanion {
 public:
  SessionRecording(std::shared_ptr<RecordingDisk> disk, std::shared_ptr<RecordingDisk::File> file)
      : disk_(std::move(disk)), file_(std::move(file)) {}
  /// Removes the file unless the session came to be.
  ~SessionRecording() override;

  void upload(const v1::CreateSessionRequest& part);
  /// The upload made a session.
  void keep() { kept_ = true; }
  void frame(RecordedParts parts);
  void commit(const v1::Commit& request);
  void answer(std::uint64_t frame, const Outcome<std::shared_ptr<const Answer>>& outcome);
  void change(const v1::ChangeSceneRequest& request);
  void changed(const Outcome<SessionState>& outcome);

 private:
  template <class Fill>
  void write(Fill fill);

  // Constant after construction.
  const std::shared_ptr<RecordingDisk> disk_;
  const std::shared_ptr<RecordingDisk::File> file_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();

  bool kept_ = false;
};

/// Where a session is recorded; null where it is not. Its companion is this and nothing else
/// (create_call.cpp).
inline std::shared_ptr<SessionRecording> recording_of(const Session& session) {
  return std::static_pointer_cast<SessionRecording>(session.companion());
}

/// What a session calls before it carries out a request, and after.
template <class Done>
struct Hooks {
  Session::Before before;
  Done done;
};
/// `done` after what was sent and what came of it are written, in the order in which the session does its
/// work. A request that the session refuses before its turn is not written. Without a recording: `done`
/// itself.
Hooks<Session::StepDone> recorded(const std::shared_ptr<SessionRecording>& recording, std::uint64_t frame,
                                  RecordedParts parts, Session::StepDone done);
Hooks<Session::StepDone> recorded(const std::shared_ptr<SessionRecording>& recording,
                                  const v1::Commit& request, Session::StepDone done);
/// What is kept of the request until its turn is charged to `account`, which may be null.
Hooks<Session::ChangeDone> recorded(const std::shared_ptr<SessionRecording>& recording,
                                    const v1::ChangeSceneRequest& request, std::shared_ptr<Account> account,
                                    Session::ChangeDone done);

}  // namespace warmfront::server
