// SPDX-License-Identifier: Apache-2.0
// What one principal may have of the daemon. Plain values; the functions are thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "engine/result.h"
#include "server/session/limits.h"

namespace warmfront::server {

struct Quota {
  std::uint32_t sessions = 0;  ///< open at once, those being made included
  std::size_t bytes = 0;       ///< held by all of them
  std::uint32_t streams = 0;   ///< StreamSteps calls at once
  std::uint32_t frames = 0;    ///< accepted and not yet computed
  std::uint32_t uploads = 0;   ///< CreateSession calls at once
  std::uint32_t weight = 1;    ///< of the cores, beside others who wait for them

  friend bool operator==(const Quota&, const Quota&) = default;
};

/// What is said of one principal; the rest is as for all.
struct PartialQuota {
  std::optional<std::uint32_t> sessions, streams, frames, uploads, weight;
  std::optional<std::size_t> bytes;

  Quota over(Quota rest) const;
  friend bool operator==(const PartialQuota&, const PartialQuota&) = default;
};
using Quotas = std::map<std::string, PartialQuota>;  ///< by principal

/// From words NAME=VALUE, of sessions, bytes, streams, frames, uploads and weight. INVALID_ARGUMENT names the
/// word.
Result<PartialQuota> parse_quota(std::span<const std::string> words);
/// From texts "PRINCIPAL NAME=VALUE ...". INVALID_ARGUMENT also for a principal that is named twice.
Result<Quotas> parse_quotas(std::span<const std::string> texts);

/// Of a principal of which nothing is said: the limits per principal, and where those are 0, three quarters
/// of the daemon's (of uploads a quarter of the sessions) if principals are told apart, else all.
Quota default_quota(const Limits& limits, bool told_apart);

}  // namespace warmfront::server
