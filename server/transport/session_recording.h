// SPDX-License-Identifier: Apache-2.0
// What went over the wire to one session, into a file (proto/recording/README.md). Used by one thread at a
// time: by the upload, then by the session's jobs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "proto/recording/writer.h"
#include "server/session/session.h"
#include "warmfront/v1/session.pb.h"
#include "warmfront/v1/step.pb.h"

namespace warmfront::server {

/// Nothing here fails: a recording that cannot go on stops, and the session goes on.
class SessionRecording {
 public:
  explicit SessionRecording(std::unique_ptr<recording::Writer> writer) : writer_(std::move(writer)) {}
  /// Removes the file unless the session came to be.
  ~SessionRecording();
  SessionRecording(const SessionRecording&) = delete;
  SessionRecording& operator=(const SessionRecording&) = delete;

  void upload(const v1::CreateSessionRequest& part);
  /// The upload made a session.
  void keep() { kept_ = true; }
  void frame(std::vector<v1::StepFrame> parts);
  void answer(std::uint64_t frame, const Outcome<std::shared_ptr<const Answer>>& outcome);
  void change(const v1::ChangeSceneRequest& request);
  void changed(const Outcome<SessionState>& outcome);

 private:
  template <class Fill>
  void write(Fill fill);

  const std::unique_ptr<recording::Writer> writer_;
  bool kept_ = false;
};

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
                                  std::vector<v1::StepFrame> parts, Session::StepDone done);
Hooks<Session::ChangeDone> recorded(const std::shared_ptr<SessionRecording>& recording,
                                    const v1::ChangeSceneRequest& request, Session::ChangeDone done);

}  // namespace warmfront::server
