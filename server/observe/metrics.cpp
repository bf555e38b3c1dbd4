// SPDX-License-Identifier: Apache-2.0
// Counting. Thread safety as stated in the header.
#include "server/observe/metrics.h"

#include <algorithm>
#include <bit>
#include <string_view>

namespace warmfront::server {
namespace {

void add(Counter& counter, std::uint64_t more) {
  counter.fetch_add(more, std::memory_order_relaxed);
}

const char* name_of(Reason reason) {
  switch (reason) {
    case Reason::kInvalidInput:
      return "invalid_input";
    case Reason::kSessionNotFound:
      return "session_not_found";
    case Reason::kSessionExists:
      return "session_exists";
    case Reason::kSessionAttached:
      return "session_attached";
    case Reason::kFrameOutOfOrder:
      return "frame_out_of_order";
    case Reason::kFrameChanged:
      return "frame_changed";
    case Reason::kProtocol:
      return "protocol";
    case Reason::kLimit:
      return "other";
    case Reason::kDraining:
      return "draining";
    case Reason::kEngine:
      return "engine";
    case Reason::kTimeout:
      return "timeout";
    case Reason::kCancelled:
      return "cancelled";
    case Reason::kUnauthenticated:
      return "unauthenticated";
    case Reason::kPermissionDenied:
      return "permission_denied";
    case Reason::kDataLoss:
      return "data_loss";
    case Reason::kStateChanged:
      return "state_changed";
  }
  return "other";
}

}  // namespace

void DurationHistogram::observe(double seconds) {
  const double units = seconds / upper_bound_seconds(0);
  // Bucket b holds up to 2^b units.
  const std::size_t bucket =
      units <= 1      ? 0
      : units >= 1e12 ? kBuckets - 1
                      : static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(units - 1e-9)));
  add(buckets_[std::min(bucket, kBuckets - 1)], 1);
  add(nanoseconds_, static_cast<std::uint64_t>(1e9 * std::max(seconds, 0.0)));
}

void Metrics::call_began(std::string_view method) noexcept {
  for (std::size_t i = 0; i < kCallNames.size(); ++i)
    if (kCallNames[i] == method) calls[i].fetch_add(1, std::memory_order_relaxed);
}

void Metrics::step_done(const StepStatistics& statistics, std::uint64_t step_contacts,
                        double waited_seconds) noexcept {
  const StageTimes& ms = statistics.ms;
  step_seconds[kRefit].observe(1e-3 * ms.refit);
  step_seconds[kFront].observe(1e-3 * ms.front);
  step_seconds[kElementary].observe(1e-3 * ms.elementary);
  step_seconds[kAdjacent].observe(1e-3 * ms.adjacent);
  step_seconds[kTotal].observe(1e-3 * ms.total);
  queue_seconds.observe(waited_seconds);
  add(contacts, step_contacts);
  add(steps_by_front[static_cast<std::size_t>(statistics.front_state)], 1);
  add(front_pairs, statistics.counts.front_pairs);
  add(front_pairs_skipped, statistics.counts.front_skipped);
  if (statistics.rebuild != Rebuild::kNone) add(rebuilds[static_cast<std::size_t>(statistics.rebuild)], 1);
}

void Metrics::self_checked(Check outcome) noexcept {
  add(self_checks[static_cast<std::size_t>(outcome)], 1);
}

void Metrics::refused_with(const Fault& fault) {
  refused_with(fault.reason == Reason::kLimit && *fault.limit != '\0' ? fault.limit : name_of(fault.reason));
}

void Metrics::refused_with(const char* reason) {
  const auto at = std::ranges::find(kRefusals, std::string_view(reason));
  add(refused[at == kRefusals.end() ? 0 : static_cast<std::size_t>(at - kRefusals.begin())], 1);
}

}  // namespace warmfront::server
