// SPDX-License-Identifier: Apache-2.0
// The live line: see live.h.
#include "client/cli/load/live.h"

#include <cstdio>

#include "client/cli/load/report.h"
#include "client/cli/progress.h"

namespace warmfront::client::load {
namespace {

constexpr double kPlainInterval = 5;

}  // namespace

Live::Live(const Plan& plan) : plan_(plan), terminal_(is_capable_terminal()) {}

Live::~Live() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

void Live::show(const Second& second) {
  errors_ += second.errors;
  if (!terminal_ && second.at - last_ < kPlainInterval) return;
  last_ = second.at;
  const char* phase = second.at <= plan_.ramp              ? "ramp"
                      : second.at <= plan_.measured_from() ? "warm-up"
                                                           : "measured";
  std::fprintf(stderr,
               "%s%5.0f of %.0f s, %s, %u sessions, %s: %.0f frames/s, %.0f contacts/s, p50 %.2f ms, p99 "
               "%.2f ms, %llu errors%s",
               terminal_ ? "\r" : "", second.at, plan_.end(), phase, plan_.sessions, model_of(plan_).c_str(),
               static_cast<double>(second.frames) / second.seconds,
               static_cast<double>(second.contacts) / second.seconds, second.p50_ms, second.p99_ms,
               static_cast<unsigned long long>(errors_), terminal_ ? "\033[K" : "\n");
  std::fflush(stderr);
  shown_ = terminal_;
}

}  // namespace warmfront::client::load
