// SPDX-License-Identifier: Apache-2.0
// What went over the wire to one session, on its way into a file (proto/recording/README.md). Used by one
// thread at a time: by the upload, then by the session's jobs.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <variant>
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
  void answer(std::uint64_t frame, const FrameOutcome& outcome);
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

/// What a frame leaves in the recording of its session: what was sent, once its turn has come, and what came
/// of it, in the order in which the session does its work. A frame that is refused before its turn leaves
/// nothing, and nor does one of a session that is not recorded: `recording` may be null.
class FrameRecord {
 public:
  FrameRecord(std::shared_ptr<SessionRecording> recording, std::uint64_t frame, RecordedParts sent)
      : recording_(std::move(recording)), frame_(frame), sent_(std::move(sent)) {}
  FrameRecord(std::shared_ptr<SessionRecording> recording, const v1::Commit& sent)
      : recording_(std::move(recording)), frame_(sent.frame()), sent_(sent) {}

  void begins();
  void answered(const FrameOutcome& outcome) noexcept;

 private:
  std::shared_ptr<SessionRecording> recording_;
  std::uint64_t frame_;
  std::variant<RecordedParts, v1::Commit> sent_;
  bool begun_ = false;
};

/// The same of a change. What is kept of the request until its turn is charged to `account`, which may be
/// null.
class ChangeRecord {
 public:
  ChangeRecord(std::shared_ptr<SessionRecording> recording, const v1::ChangeSceneRequest& request,
               std::shared_ptr<Account> account);

  void begins();
  void answered(const Outcome<SessionState>& outcome) noexcept;

 private:
  std::shared_ptr<SessionRecording> recording_;
  v1::ChangeSceneRequest request_;
  Holding memory_;
  bool begun_ = false;
};

}  // namespace warmfront::server
