// SPDX-License-Identifier: Apache-2.0
// What the daemon counts as it works. Thread-safe; counting costs a few atomics and never allocates.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "engine/statistics.h"
#include "server/fault.h"
#include "server/session/observer.h"

namespace warmfront::server {

using Counter = std::atomic<std::uint64_t>;

/// Durations in buckets, each twice as long as the one before, from 10 microseconds to some 40 seconds.
class DurationHistogram {
 public:
  static constexpr std::size_t kBuckets = 23;  ///< the last one has no upper bound
  static double upper_bound_seconds(std::size_t bucket) { return 1e-5 * static_cast<double>(1ULL << bucket); }

  void observe(double seconds);

  std::uint64_t count(std::size_t bucket) const { return buckets_[bucket].load(std::memory_order_relaxed); }
  double sum_seconds() const {
    return 1e-9 * static_cast<double>(nanoseconds_.load(std::memory_order_relaxed));
  }

 private:
  std::array<Counter, kBuckets> buckets_{};
  Counter nanoseconds_{0};
};

struct Metrics final : SessionObserver {
  enum Stage : std::size_t { kRefit, kFront, kElementary, kAdjacent, kTotal, kStages };
  static constexpr std::array<const char*, kStages> kStageNames{"refit", "front", "elementary", "adjacent",
                                                                "total"};
  static constexpr std::array<const char*, 5> kFrontNames{"none", "built", "updated", "rebuilt", "capped"};
  /// By Rebuild, the first of which is none at all.
  static constexpr std::array<const char*, 7> kRebuildNames{"none",   "policy", "decayed",   "interrupted",
                                                            "capped", "bounds", "self_check"};
  /// By SessionObserver::Check.
  static constexpr std::array<const char*, 3> kSelfCheckNames{"passed", "rebuilt", "data_loss"};
  enum End : std::size_t { kDeleted, kExpired, kFailed, kEnds };
  static constexpr std::array<const char*, kEnds> kEndNames{"deleted", "expired", "failed"};
  /// The methods of both services.
  static constexpr std::array<const char*, 12> kCallNames{
      "CreateSession", "GetSession", "ListSessions", "DeleteSession", "ChangeScene",     "StreamChangeScene",
      "CheckSession",  "Step",       "StreamSteps",  "GetServerInfo", "ListAllSessions", "DeleteAnySession"};
  /// Of files that are read again while the daemon runs.
  enum Reload : std::size_t { kTokenFile, kCertificates, kReloads };
  static constexpr std::array<const char*, kReloads> kReloadNames{"token_file", "certificates"};
  /// Of refused requests: each limit by its setting, everything else by its kind.
  static constexpr std::array<const char*, 34> kRefusals{"other",
                                                         "invalid_input",
                                                         "session_not_found",
                                                         "session_exists",
                                                         "session_attached",
                                                         "frame_out_of_order",
                                                         "frame_changed",
                                                         "protocol",
                                                         "draining",
                                                         "engine",
                                                         "timeout",
                                                         "cancelled",
                                                         "unauthenticated",
                                                         "permission_denied",
                                                         "data_loss",
                                                         "state_changed",
                                                         "max-sessions",
                                                         "max-sessions-per-principal",
                                                         "max-vertices",
                                                         "max-triangles",
                                                         "max-contacts",
                                                         "adjacent-faces",
                                                         "memory",
                                                         "max-session-bytes",
                                                         "max-principal-bytes",
                                                         "max-total-bytes",
                                                         "max-open-streams",
                                                         "max-streams-per-principal",
                                                         "max-uploads-per-principal",
                                                         "max-frames-per-principal",
                                                         "max-frames-in-flight",
                                                         "max-message-bytes",
                                                         "window",
                                                         "write-stall-timeout"};

  void step_done(const StepStatistics& statistics, std::uint64_t step_contacts,
                 double waited_seconds) noexcept override;
  void self_checked(Check outcome) noexcept override;
  void refused_with(const Fault& fault);
  void refused_with(const char* reason);
  /// `method` is one of kCallNames.
  void call_began(std::string_view method) noexcept;

  std::array<DurationHistogram, kStages> step_seconds;
  DurationHistogram queue_seconds;
  Counter contacts{0};
  std::array<Counter, kFrontNames.size()> steps_by_front{};
  std::array<Counter, kRebuildNames.size()> rebuilds{};
  std::array<Counter, kSelfCheckNames.size()> self_checks{};
  Counter front_pairs{0};          ///< over all steps: pairs that the front held
  Counter front_pairs_skipped{0};  ///< of these, not looked at
  std::array<Counter, kCallNames.size()> calls{};
  Counter sessions_created{0};
  std::array<Counter, kEnds> sessions_ended{};
  std::array<Counter, kRefusals.size()> refused{};
  std::array<Counter, kReloads> reload_failures{};  ///< what was read before serves on
  Counter memory_given_back{0};                     ///< bytes that FreeMemory gave back
};

}  // namespace warmfront::server
