// SPDX-License-Identifier: Apache-2.0
// A proxy that forwards new connections to one of several Unix sockets, as commanded: a load balancer when a
// daemon is lost and returns. Thread-safe.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/server/local_daemon.h"

namespace warmfront::test {

class SwitchProxy {
 public:
  /// Listens on a socket of its own, and leads to the first of `targets`, paths of sockets.
  explicit SwitchProxy(std::vector<std::string> targets);
  /// Ends all connections.
  ~SwitchProxy();
  SwitchProxy(const SwitchProxy&) = delete;
  SwitchProxy& operator=(const SwitchProxy&) = delete;

  /// unix:PATH.
  std::string address() const;

  /// Whether clients find beside address() the socket at which the target that is led to shares memory
  /// (proto/README.md). What goes over that goes by no proxy: it is not lost, and ends with its stream.
  void share_memory(bool shared);

  /// Ends all connections; new ones go to `target`. Returns when the old ones are closed.
  void lead_to(std::size_t target);
  /// From now on drops the daemons' data, until the next lead_to(): answers are lost in transit.
  void lose_answers();
  enum class Way : std::uint8_t { kToDaemon, kToClient };
  /// The connection that carries byte n from now on, counted from 0, of all that go that way, ends before it;
  /// with n < 0 none does.
  void end_before(Way way, long n);
  /// Has that happened?
  bool ended();

 private:
  struct Connection {
    int client;
    int daemon;
  };
  void run();
  void accept_one();
  bool forward(const Connection& connection, bool from_client);
  void close_all();
  void wake();
  void place_link();

  const TemporaryFolder folder_;
  const std::vector<std::string> targets_;
  int listener_ = -1;
  int wake_[2] = {-1, -1};

  std::mutex mutex_;
  std::condition_variable changed_;
  // Under mutex_.
  std::size_t target_ = 0;
  bool shares_memory_ = false;
  bool lose_answers_ = false;
  Way end_way_ = Way::kToDaemon;
  long bytes_left_ = -1;  // before that end
  bool ended_ = false;
  bool cut_ = false;
  bool stopping_ = false;

  std::vector<Connection> connections_;  // of run()'s thread
  std::thread thread_;
};

}  // namespace warmfront::test
