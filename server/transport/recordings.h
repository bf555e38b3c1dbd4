// SPDX-License-Identifier: Apache-2.0
// The folder that a daemon records its sessions into, and the bound on what it holds. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "engine/result.h"
#include "server/log.h"
#include "server/session/account.h"
#include "server/session/id.h"
#include "server/transport/session_recording.h"

namespace warmfront::server {

class Recordings {
 public:
  /// `folder` exists and may be written to, else kInvalidArgument. Recordings that are in it already count
  /// towards `max_bytes`. `log` outlives this and every recording.
  static Result<std::shared_ptr<Recordings>> open(const std::string& folder, std::uint64_t max_bytes,
                                                  Log& log, RecordingOptions options = {});

  /// A new file of the folder, SESSION-TIME-NUMBER.wfrec, which is made soon; what waits for that is charged
  /// to `account`, which may be null. Null, with a line in the log, where there is no room.
  std::shared_ptr<SessionRecording> begin(const SessionId& session, std::shared_ptr<Account> account);

  /// See RecordingDisk.
  void finish_by(std::chrono::steady_clock::time_point deadline) { disk_->finish_by(deadline); }
  std::size_t queued_bytes() const { return disk_->queued_bytes(); }

 private:
  Recordings(std::string folder, std::shared_ptr<RecordingDisk> disk)
      : folder_(std::move(folder)), disk_(std::move(disk)) {}

  const std::string folder_;
  const std::shared_ptr<RecordingDisk> disk_;  // its recordings' too
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace warmfront::server
