// SPDX-License-Identifier: Apache-2.0
// A running daemon: the factory that builds the server, in warmfrontd's main() and in tests alike.
// Thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/result.h"
#include "server/config.h"
#include "server/log.h"

namespace warmfront::server {

class Daemon {
 public:
  /// Listens and serves when it returns. Fails for an address that cannot or may not be listened on. `log`
  /// outlives the daemon. Port 0 picks a free one.
  static Result<std::unique_ptr<Daemon>> start(const Config& config, Log& log);
  /// Stops at once: calls in flight are cancelled. Waits for steps under way.
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Where it listens, with the ports that were picked.
  const std::vector<std::string>& addresses() const;

  /// Of /metrics; 0 when there is none.
  int metrics_port() const;

  /// Does this soon, on a thread that steps run on, behind what waits there.
  void when_runner_moves(std::function<void()> task);

  /// Whether it lives (observe/liveness.h), for a watchdog. However busy it is.
  bool alive() const;

  /// Reads the token file and the certificates again, and ends the streams and uploads of those whose token
  /// is gone. What cannot be used is logged and changes nothing; false then.
  bool reload();

  /// Stops in good order: reports NOT_SERVING, refuses new calls, notifies streams, delivers the frames in
  /// hand, stops listening. True when all was delivered within the drain timeout; what was not is cancelled.
  /// Call it once.
  bool drain();

 private:
  struct Impl;
  explicit Daemon(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront::server
