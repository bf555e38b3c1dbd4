// SPDX-License-Identifier: Apache-2.0
// A faulty proxy: it forwards connections to a Unix socket, and delays, cuts and resets them at random.
// Thread-safe.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace warmfront::test {

class ChaosProxy {
 public:
  /// Listens on a loopback port of its own and forwards to the socket at `path`; `seed` decides what it does
  /// to whom.
  ChaosProxy(std::string path, std::uint64_t seed);
  /// Ends all connections.
  ~ChaosProxy();
  ChaosProxy(const ChaosProxy&) = delete;
  ChaosProxy& operator=(const ChaosProxy&) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  /// From now on everything passes as it comes.
  void behave() { behaving_ = true; }

  struct Counts {
    std::atomic<std::uint64_t> connections{0}, bytes{0}, delays{0}, cuts{0}, resets{0};
  };
  const Counts& counts() const { return counts_; }

 private:
  void accept_all();
  void forward(int client, std::uint64_t seed);

  // Constant after construction.
  const std::string path_;
  const std::uint64_t seed_;
  int listener_ = -1;
  int port_ = 0;

  // Atomic.
  std::atomic<bool> stopping_{false};
  std::atomic<bool> behaving_{false};
  Counts counts_;

  // Used by accept_all(), and by the destructor once that has ended.
  std::vector<std::thread> forwarders_;
  std::thread acceptor_;
};

}  // namespace warmfront::test
