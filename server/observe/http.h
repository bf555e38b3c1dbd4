// SPDX-License-Identifier: Apache-2.0
// The small HTTP listener for those who watch the daemon: /metrics, /healthz, /readyz. Thread-safe.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "engine/result.h"

namespace warmfront::server {

class Http {
 public:
  struct Pages {
    std::function<std::string()> metrics;
    std::function<bool()> ready;
    std::function<bool()> alive;
  };
  /// Listens at HOST:PORT; port 0 picks a free one. `pages` are called from threads of its own until it is
  /// destroyed. Fails for an address that cannot be bound. /healthz is 200 while the daemon is alive,
  /// /readyz while new sessions are taken; 503 otherwise.
  static Result<std::unique_ptr<Http>> start(const std::string& address, Pages pages);
  ~Http();
  Http(const Http&) = delete;
  Http& operator=(const Http&) = delete;

  int port() const;

 private:
  struct Impl;
  explicit Http(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace warmfront::server
