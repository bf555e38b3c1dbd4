// SPDX-License-Identifier: Apache-2.0
// Live status of a load on stderr: one line, redrawn every second on a terminal, a plain line every five
// seconds elsewhere. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <string>

#include "client/cli/load/histogram.h"
#include "client/cli/load/measured.h"

namespace warmfront::client::load {

/// What a line tells: a second's end, and sums since the line before.
struct Shown {
  /// At its end; `seconds`, `frames` and `contacts` are the sums. Its p50 and p99 are of the last second
  /// alone.
  Second second = {.seconds = 0};
  Histogram latency;
  std::uint64_t errors = 0;  ///< since the start

  void add(const Second& next, const Histogram& its_latency);
};

/// The line, without its end: never more seconds than the plan has.
std::string live_line(const Plan& plan, const Shown& shown);

class Live {
 public:
  explicit Live(const Plan& plan);
  /// Erases the line.
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  void show(const Second& second, const Histogram& latency);

 private:
  const Plan& plan_;
  const bool terminal_;
  bool shown_ = false;
  Shown next_;
};

}  // namespace warmfront::client::load
