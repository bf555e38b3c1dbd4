// SPDX-License-Identifier: Apache-2.0
#include "server/config_remarks.h"

#include <array>
#include <sstream>
#include <string_view>
#include <utility>

#include "server/config_file.h"
#include "server/session/quota.h"
#include "server/settings.h"
#include "server/units.h"

namespace warmfront::server {
namespace {

/// A principal's limit beside that of all.
struct Pair {
  std::string name;
  std::uint64_t value;  ///< 0: not set
  const char* of_all;
  std::uint64_t most;
  bool in_bytes = false;

  std::string words(std::uint64_t n) const { return in_bytes ? describe_bytes(n) : std::to_string(n); }
  std::string remark() const {
    return name + " is " + words(value) + ", and " + of_all + " " + words(most) +
           ": no principal gets more than that; lower the one or raise the other";
  }
};

std::array<Pair, 5> pairs(const Limits& all, const Quota& quota, const std::array<std::string, 5>& names) {
  return {{{names[0], quota.sessions, "max-sessions", all.max_sessions},
           {names[1], quota.bytes, "max-total-bytes", all.max_total_bytes, true},
           {names[2], quota.streams, "max-open-streams", all.max_open_streams},
           {names[3], quota.frames, "max-frames-in-flight", all.max_frames_in_flight},
           {names[4], quota.uploads, "max-sessions", all.max_sessions}}};
}

/// As --print-config writes them.
std::string text_of(const std::vector<std::string>& values) {
  std::string text;
  for (const std::string& value : values) text.append(text.empty() ? "" : ", ").append(toml_string(value));
  return text.empty() ? "nothing" : text;
}

}  // namespace

std::vector<std::string> contradictions(const Config& config) {
  std::vector<std::string> remarks;
  const auto add = [&](const std::array<Pair, 5>& some) {
    for (const Pair& pair : some)
      if (pair.value > pair.most) remarks.push_back(pair.remark());
  };
  const Limits& limits = config.limits;
  add(pairs(limits,
            {.sessions = limits.max_sessions_per_principal,
             .bytes = limits.max_principal_bytes,
             .streams = limits.max_streams_per_principal,
             .frames = limits.max_frames_per_principal,
             .uploads = limits.max_uploads_per_principal},
            {"max-sessions-per-principal", "max-principal-bytes", "max-streams-per-principal",
             "max-frames-per-principal", "max-uploads-per-principal"}));
  const Result<Quotas> quotas = parse_quotas(config.quotas);
  if (quotas.ok())
    for (const auto& [principal, quota] : quotas.value()) {
      const std::string name = "quotas: " + principal + "'s ";
      add(pairs(
          limits,
          quota.over({.sessions = 0, .bytes = 0, .streams = 0, .frames = 0, .uploads = 0, .weight = 1}),
          {name + "sessions=", name + "bytes=", name + "streams=", name + "frames=", name + "uploads="}));
    }
  if (config.token_file.empty() && config.tls.client_ca.empty()) {
    const std::string nobody =
        " names principals, and callers are not told apart: set --token-file or "
        "--tls-client-ca";
    if (!config.quotas.empty()) remarks.push_back("quotas" + nobody);
    if (!config.admins.empty()) remarks.push_back("admins" + nobody);
  }
  return remarks;
}

std::vector<std::string> not_in_force(const Config& running, const Config& read) {
  std::vector<std::string> remarks;
  for (const Setting& setting : settings()) {
    const std::string now = text_of(setting.get(running)), then = text_of(setting.get(read));
    if (now != then)
      remarks.push_back(std::string(setting.name) + " is " + then + " now, and " + now +
                        " is in force: restart the daemon for it");
  }
  return remarks;
}

std::string would_not_start(std::string mistakes) {
  constexpr std::string_view kBegin = "warmfrontd: ";
  std::istringstream lines(std::move(mistakes));
  std::string text = "the daemon would not start with the configuration as it is now";
  for (std::string line; std::getline(lines, line);)
    text.append("; ").append(line.starts_with(kBegin) ? line.substr(kBegin.size()) : line);
  return text;
}

}  // namespace warmfront::server
