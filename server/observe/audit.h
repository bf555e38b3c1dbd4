// SPDX-License-Identifier: Apache-2.0
// What administrators do, and what is tried without the right to: an event each, in the log and, where a file
// is given, there as well, whatever the log's level. Thread-safe.
#pragma once

#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "engine/result.h"
#include "server/log.h"

namespace warmfront::server {

struct AuditEvent {
  std::string action;     ///< the method, or "reload" and "drain", which signals ask for
  std::string principal;  ///< who; empty where callers are not told apart
  std::string peer = {};  ///< from where
  std::string request_id = {};
  std::string session = {};  ///< what it was about, if a session
  std::string owner = {};    ///< whose that was
  int code = 0;              ///< google.rpc.Code
  std::string reason = {};   ///< why it was refused
};

class Audit {
 public:
  /// Appends to `file`, unless its name is empty. kInvalidArgument where it cannot be opened. `log` outlives
  /// it.
  static Result<std::unique_ptr<Audit>> open(const std::string& file, Log& log);

  /// What is recorded is in the file when it returns. Nothing is thrown: what has no memory or no disk is an
  /// error in the log.
  void record(const AuditEvent& event) noexcept;

 private:
  explicit Audit(Log& log) : log_(log) {}

  Log& log_;
  std::mutex mutex_;  // of the file
  std::ofstream file_;
  std::optional<Log> to_file_;
};

}  // namespace warmfront::server
