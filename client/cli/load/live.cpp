// SPDX-License-Identifier: Apache-2.0
// The live line: see live.h.
#include "client/cli/load/live.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "client/cli/load/report.h"
#include "client/cli/print.h"
#include "client/cli/progress.h"

namespace warmfront::client::load {
namespace {

constexpr double kPlainInterval = 5;

std::string rates_of(const Shown& shown) {
  const Second& sum = shown.second;
  const std::string period = print("in the last %.0f s", sum.seconds);
  if (sum.frames == 0) return period + " no answers";
  return period + print(": %.0f frames/s, %.0f contacts/s, p50 %.2f ms, p99 %.2f ms",
                        static_cast<double>(sum.frames) / sum.seconds,
                        static_cast<double>(sum.contacts) / sum.seconds, shown.latency.quantile(0.5),
                        shown.latency.quantile(0.99));
}

std::string unserved_of(const Plan& plan, const Second& now) {
  std::string text;
  const auto some = [&](std::uint32_t count, const char* what) {
    if (count == 0) return;
    text += text.empty() ? "; now " : " and ";
    text += print("%u of %u sessions %s", count, plan.sessions, what);
  };
  some(now.without_daemon, "without a daemon");
  some(now.refused, "refused");
  return text.empty() ? text : text + print(", since %.1f s", now.unserved_since);
}

}  // namespace

void Shown::add(const Second& next, const Histogram& its_latency) {
  const Second sum = std::exchange(second, next);
  second.seconds += sum.seconds;
  second.frames += sum.frames;
  second.contacts += sum.contacts;
  errors += next.errors;
  latency.merge(its_latency);
}

std::string live_line(const Plan& plan, const Shown& shown) {
  const double at = shown.second.at;
  const char* phase = at <= plan.ramp              ? "ramp"
                      : at <= plan.measured_from() ? "warm-up"
                      : at <= plan.end()           ? "measured"
                                                   : "ended, answers are due";
  return print("%5.0f of %.0f s, %s, %u sessions, %s; ", std::min(at, plan.end()), plan.end(), phase,
               plan.sessions, model_of(plan).c_str()) +
         rates_of(shown) + print("; %llu errors so far", static_cast<unsigned long long>(shown.errors)) +
         unserved_of(plan, shown.second);
}

Live::Live(const Plan& plan) : plan_(plan), terminal_(is_capable_terminal()) {}

Live::~Live() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

void Live::show(const Second& second, const Histogram& latency) {
  next_.add(second, latency);
  // A second's end is a little late.
  if (!terminal_ && next_.second.seconds < kPlainInterval - 0.1) return;
  std::fprintf(stderr, "%s%s%s", terminal_ ? "\r" : "", live_line(plan_, next_).c_str(),
               terminal_ ? "\033[K" : "\n");
  std::fflush(stderr);
  shown_ = terminal_;
  const std::uint64_t errors = next_.errors;
  next_ = {};
  next_.errors = errors;
}

}  // namespace warmfront::client::load
