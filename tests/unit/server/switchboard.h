// SPDX-License-Identifier: Apache-2.0
// A proxy between a client and several daemons, switched by a test: a load balancer when a daemon is away,
// returns, or its answers are lost. Thread-safe.
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {

class Switchboard {
 public:
  /// Listens on a Unix socket in a folder of its own, and leads to the daemon at `to`, "unix:PATH".
  explicit Switchboard(const std::string& to);
  /// Ends all connections.
  ~Switchboard();
  Switchboard(const Switchboard&) = delete;
  Switchboard& operator=(const Switchboard&) = delete;

  std::string address() const { return "unix:" + path_; }
  /// Cuts all connections. New ones lead to the daemon at `to`, and its answers arrive.
  void lead_to(const std::string& to);
  /// Requests arrive at the daemon from now on, but none of its answers at the client.
  void lose_answers() { losing_ = true; }

 private:
  void accept_all();
  void forward(int client, const std::string& to, unsigned epoch);

  // Constant after construction.
  const TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "board.sock").string();
  int listener_ = -1;

  std::atomic<bool> stopping_{false};
  std::atomic<bool> losing_{false};
  std::atomic<unsigned> epoch_{0};  // connections of an earlier one are to be cut

  // Protected by mutex_.
  std::mutex mutex_;
  std::string to_;

  // Used by accept_all(), and by the destructor once that has ended.
  std::vector<std::thread> forwarders_;
  std::thread acceptor_;
};

}  // namespace warmfront::test
