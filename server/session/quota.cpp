// SPDX-License-Identifier: Apache-2.0
// Quotas in words. Thread-safe.
#include "server/session/quota.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <sstream>
#include <vector>

#include "server/units.h"

namespace warmfront::server {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
constexpr std::uint64_t kMostWeight = 1000;

/// Three quarters of what there is, at least one.
template <class T>
T most_of(T all) {
  return std::max<T>(1, all - all / 4);
}

}  // namespace

Quota PartialQuota::over(Quota rest) const {
  rest.sessions = sessions.value_or(rest.sessions);
  rest.bytes = bytes.value_or(rest.bytes);
  rest.streams = streams.value_or(rest.streams);
  rest.frames = frames.value_or(rest.frames);
  rest.uploads = uploads.value_or(rest.uploads);
  rest.weight = weight.value_or(rest.weight);
  return rest;
}

Result<PartialQuota> parse_quota(std::span<const std::string> words) {
  PartialQuota quota;
  for (const std::string& word : words) {
    const std::size_t sign = word.find('=');
    const std::string name = word.substr(0, sign);
    const std::string value = sign == std::string::npos ? "" : word.substr(sign + 1);
    if (name == "bytes") {
      const Result<std::uint64_t> bytes = parse_bytes(value, 1 << 16);
      if (!bytes) return invalid_argument(word + ": " + bytes.error().message);
      quota.bytes = bytes.value();
      continue;
    }
    std::optional<std::uint32_t>* number = name == "sessions"  ? &quota.sessions
                                           : name == "streams" ? &quota.streams
                                           : name == "frames"  ? &quota.frames
                                           : name == "uploads" ? &quota.uploads
                                           : name == "weight"  ? &quota.weight
                                                               : nullptr;
    if (number == nullptr)
      return invalid_argument(
          word + ": sessions=, bytes=, streams=, frames=, uploads= or weight= and a value is expected");
    const Result<std::uint64_t> parsed = parse_integer(value, 1, name == "weight" ? kMostWeight : kMost);
    if (!parsed) return invalid_argument(word + ": " + parsed.error().message);
    *number = static_cast<std::uint32_t>(parsed.value());
  }
  return quota;
}

Result<Quotas> parse_quotas(std::span<const std::string> texts) {
  Quotas quotas;
  for (const std::string& text : texts) {
    std::istringstream in(text);
    const std::vector<std::string> words{std::istream_iterator<std::string>(in), {}};
    if (words.size() < 2)
      return invalid_argument("\"" + text + "\": PRINCIPAL NAME=VALUE ... is expected, e.g. alice sessions=8");
    Result<PartialQuota> quota = parse_quota(std::span(words).subspan(1));
    if (!quota) return quota.error();
    if (!quotas.emplace(words.front(), quota.value()).second)
      return invalid_argument("\"" + text + "\": the principal is named before");
  }
  return quotas;
}

Quota default_quota(const Limits& limits, bool told_apart) {
  const auto choose = [&](auto per_principal, auto all) {
    return per_principal != 0 ? per_principal : told_apart ? most_of(all) : all;
  };
  return {.sessions = choose(limits.max_sessions_per_principal, limits.max_sessions),
          .bytes = choose(limits.max_principal_bytes, limits.max_total_bytes),
          .streams = choose(limits.max_streams_per_principal, limits.max_open_streams),
          .frames = choose(limits.max_frames_per_principal, limits.max_frames_in_flight),
          .uploads = limits.max_uploads_per_principal != 0 ? limits.max_uploads_per_principal
                     : told_apart ? std::max<std::uint32_t>(1, limits.max_sessions / 4)
                                  : limits.max_sessions,
          .weight = 1};
}

}  // namespace warmfront::server
