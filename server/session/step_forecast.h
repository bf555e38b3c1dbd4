// SPDX-License-Identifier: Apache-2.0
// How long a session's next request will take, by what its last ones took. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/statistics.h"
#include "server/session/mailbox.h"
#include "server/session/step_cost.h"

namespace warmfront::server {

class StepForecast {
 public:
  /// Of a session with so many elements that has computed nothing.
  explicit StepForecast(std::uint64_t elements) : next_ms_(step_cost_ms(elements, {})) {}

  Lane lane() const { return lane_of(next_ms_); }
  /// Milliseconds of one thread; Mailbox::kUnforeseen where that cannot be told.
  double next_ms() const { return is_foreseen_ ? next_ms_ : Mailbox::kUnforeseen; }

  void begins() { stepped_ = false; }
  /// A question was computed: what the next one takes is told by it. `beside`: what ran beside it to explain.
  void computed(const StepCounts& counts, const std::optional<StepCounts>& beside) {
    counts_ = counts;
    beside_ = beside;
  }
  /// The request was a step, and was carried out.
  void stepped() { stepped_ = true; }
  /// The request took so long. `check_is_due`: a self-check comes before the next step.
  void took(double ms, std::uint64_t elements, bool check_is_due);

 private:
  double next_ms_;
  bool is_foreseen_ = false;
  bool stepped_ = false;
  StepCounts counts_;
  std::optional<StepCounts> beside_;
};

}  // namespace warmfront::server
