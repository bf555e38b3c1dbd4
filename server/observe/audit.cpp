// SPDX-License-Identifier: Apache-2.0
#include "server/observe/audit.h"

#include <unistd.h>

#include <cstdint>
#include <exception>

#include "server/observe/private_file.h"

namespace warmfront::server {

Result<std::unique_ptr<Audit>> Audit::open(const std::string& file, Log& log) {
  std::unique_ptr<Audit> audit(new Audit(log));
  if (file.empty()) return audit;
  const Result<int> made = open_private_file("audit-file", file);
  if (!made) return made.error();
  audit->file_.open(file, std::ios::app);
  ::close(made.value());
  if (!audit->file_) return invalid_argument("audit-file " + file + ": it cannot be opened for writing");
  audit->to_file_.emplace(LogLevel::kInfo, LogFormat::kJson, &audit->file_);
  return audit;
}

void Audit::record(const AuditEvent& event) noexcept try {
  const auto write = [&](Log& log) {
    log.write(LogLevel::kInfo, "audit",
              {{"action", event.action},
               {"principal", event.principal},
               {"peer", event.peer},
               {"request_id", event.request_id},
               {"session", event.session},
               {"owner", event.owner},
               {"code", std::int64_t{event.code}},
               {"reason", event.reason}});
  };
  write(log_);
  if (!to_file_) return;
  const std::lock_guard lock(mutex_);
  write(*to_file_);
  file_.flush();
  if (file_.good()) return;
  file_.clear();
  log_.write(LogLevel::kError, "audit_lost",
             {{"action", event.action}, {"reason", "audit-file: it cannot be written; is its disk full?"}});
} catch (const std::exception&) {
  try {
    log_.write(LogLevel::kError, "audit_lost", {{"reason", "no memory"}});
  } catch (const std::exception&) {  // nor for these words
  }
}

}  // namespace warmfront::server
