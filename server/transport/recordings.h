// SPDX-License-Identifier: Apache-2.0
// The folder that a daemon records its sessions into, and the bound on what it holds. Thread-safe.
#pragma once

#include <atomic>
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
                                                  Log& log);

  /// A new file of the folder, SESSION-TIME-NUMBER.wfrec. Null, with a line in the log, where there is no
  /// room or it cannot be made.
  static std::shared_ptr<SessionRecording> begin(const std::shared_ptr<Recordings>& recordings,
                                                 const SessionId& session);

 private:
  Recordings(std::string folder, std::uint64_t max_bytes, std::uint64_t held, Log& log)
      : folder_(std::move(folder)), held_(max_bytes), log_(log) {
    held_.take(held);
  }

  const std::string folder_;
  Budget held_;
  Log& log_;
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace warmfront::server
