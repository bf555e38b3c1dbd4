// SPDX-License-Identifier: Apache-2.0
// What sessions tell of themselves, and keep for others, without knowing to whom they do it.
#pragma once

#include <cstdint>

#include "engine/statistics.h"

namespace warmfront::server {

/// Told of what sessions do, as it happens, by any thread: thread-safe, and allocates nothing.
class SessionObserver {
 public:
  enum class Check : std::uint8_t { kPassed, kRebuilt, kDataLost };

  /// `waited_seconds` is the time between a frame's arrival and its step.
  virtual void step_done(const StepStatistics& statistics, std::uint64_t contacts,
                         double waited_seconds) noexcept = 0;
  virtual void self_checked(Check outcome) noexcept = 0;

 protected:
  ~SessionObserver() = default;
};

/// Lives as long as the session that it was given to, which does nothing else with it.
class SessionCompanion {
 public:
  SessionCompanion() = default;
  virtual ~SessionCompanion() = default;
  SessionCompanion(const SessionCompanion&) = delete;
  SessionCompanion& operator=(const SessionCompanion&) = delete;
};

}  // namespace warmfront::server
