// SPDX-License-Identifier: Apache-2.0
// Where one thread's time goes when stages of a step are interleaved in one loop. Used by one thread at a
// time.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace warmfront {

/// The stages of which a loop may mix several.
enum class Stage : std::uint8_t { kRefit, kFront, kElementary };

/// Seconds by Stage.
using StageSeconds = std::array<double, 3>;

class StageClock {
 public:
  /// The thread is in `stage` for the lifetime of this, and then again where it was before.
  class In {
   public:
    In(StageClock& clock, Stage stage) : clock_(clock), before_(clock.at_) {
      clock_.go_to(static_cast<std::size_t>(stage));
    }
    ~In() { clock_.go_to(before_); }
    In(const In&) = delete;
    In& operator=(const In&) = delete;

   private:
    StageClock& clock_;
    const std::size_t before_;
  };

  /// The time spent since the last call.
  StageSeconds take() {
    const StageSeconds taken = {seconds_[0], seconds_[1], seconds_[2]};
    seconds_ = {};
    return taken;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kNone = 3;

  void go_to(std::size_t stage) {
    const Clock::time_point now = Clock::now();
    seconds_[at_] += std::chrono::duration<double>(now - since_).count();
    at_ = stage;
    since_ = now;
  }

  std::array<double, kNone + 1> seconds_{};  // by stage; the last: in none
  std::size_t at_ = kNone;
  Clock::time_point since_{};
};

}  // namespace warmfront
