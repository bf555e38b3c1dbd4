// SPDX-License-Identifier: Apache-2.0
#include "server/startup.h"

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "engine/instructions.h"
#include "server/process/accept.h"
#include "server/process/listen.h"
#include "server/process/small_file.h"

namespace warmfront::server {

void warn_of_readable_secrets(Log& log, const Config& config) {
  const std::array<std::pair<const char*, const std::string*>, 2> secrets{
      {{"token-file", &config.token_file}, {"tls-key", &config.tls.key}}};
  for (const auto& [setting, path] : secrets)
    if (is_readable_by_others(*path))
      log.write(
          LogLevel::kWarning, "secret_readable",
          {{"file", *path},
           {"reason", std::string(setting) + ": every user of this machine may read it; chmod o= it, and "
                                             "replace what it holds if there are such users"}});
}

void warn_of_principals_without_token(Log& log, const std::vector<std::string>& principals) {
  for (const std::string& principal : principals)
    log.write(LogLevel::kWarning, "configuration",
              {{"principal", principal},
               {"reason", "admins or quotas name a principal that has no line in the token file"}});
}

std::string what_is_read_again(const Guard& guard, bool certificates) {
  std::string words;
  if (const std::optional<std::size_t> tokens = guard.token_count())
    words = "token file (" + std::to_string(*tokens) + (*tokens == 1 ? " token" : " tokens") + " in force)";
  if (certificates) words += words.empty() ? "certificates" : ", certificates";
  return words.empty() ? "nothing: there is neither a token file nor a certificate" : words;
}

void warn_of_slow_instructions(Log& log) {
  if (const std::string reason = why_instructions_are_slow(); !reason.empty())
    log.write(LogLevel::kWarning, "slow_instructions", {{"reason", reason}});
}

Result<std::vector<SocketLock>> lock_addresses(const Config& config) {
  if (config.listen.empty()) return invalid_argument("listen: at least one address is expected");
  for (const std::string& address : config.listen)
    if (const Status checked = check_listen_address(address, config.insecure || config.tls.enabled());
        !checked)
      return checked.error();
  std::vector<SocketLock> sockets;
  for (const std::string& address : config.listen) {
    const std::optional<std::string> path = unix_path(address);
    if (!path) continue;
    Result<SocketLock> lock = SocketLock::acquire(*path);
    if (!lock) return lock.error();
    sockets.push_back(std::move(lock).value());
    // One that knows nothing of the lock.
    if (someone_listens(*path))
      return Error{ErrorCode::kFailedPrecondition,
                   "listen " + address + ": another process listens there; stop it first"};
  }
  if (!config.metrics_listen.empty() && !is_host_and_port(config.metrics_listen))
    return invalid_argument("metrics-listen " + config.metrics_listen +
                            ": HOST:PORT (an IPv6 host in brackets) is expected, the port in [0, 65535]");
  return sockets;
}

Result<std::shared_ptr<Certificates>> certificates_of(const Config& config, Log& log) {
  if (!config.tls.enabled()) return std::shared_ptr<Certificates>();
  auto read = Certificates::create(config.tls, log);
  if (!read) return read.error();
  return std::shared_ptr<Certificates>(std::move(read).value());
}

}  // namespace warmfront::server
