// SPDX-License-Identifier: Apache-2.0
#include "client/lib/pending.h"

#include <algorithm>
#include <string>

namespace warmfront::client {
namespace {

/// How often a cancellation flag is polled: nobody is notified when it is set.
constexpr std::chrono::milliseconds kLook{2};

}  // namespace

Error PendingAnswer::cancelled() {
  return {ErrorCode::kCancelled, "cancelled; it does not count, and the session is where it was"};
}

Status PendingAnswer::check(const WaitOptions& wait) {
  if (wait.cancelled != nullptr && wait.cancelled->load(std::memory_order_relaxed)) return cancelled();
  if (!wait.timeout || wait.timeout->count() > 0) return {};
  return invalid_argument("timeout: " + std::to_string(wait.timeout->count()) +
                          " ms; give a positive time, or none");
}

bool PendingAnswer::wait_until(Time) {
  return settled();
}

Result<Answer> PendingAnswer::take() {
  if (std::exchange(taken_, true))
    return Error{ErrorCode::kFailedPrecondition, "the answer was taken before; call get() once"};
  wait_until(Time::max());
  if (thrown_) std::rethrow_exception(thrown_);
  return *std::move(answer_);
}

std::optional<Error> PendingAnswer::given_up(Time now, bool in_turn) {
  if (stop_.load(std::memory_order_relaxed) ||
      (wait_.cancelled != nullptr && wait_.cancelled->load(std::memory_order_relaxed)))
    return cancelled();
  if (!wait_.timeout || !in_turn) return std::nullopt;
  if (!time_up_) time_up_ = after(now, *wait_.timeout);
  if (now < *time_up_) return std::nullopt;
  return Error{ErrorCode::kDeadlineExceeded, "no answer within " + std::to_string(wait_.timeout->count()) +
                                                 " ms; it does not count, and the session is where it was"};
}

PendingAnswer::Time PendingAnswer::next_look(Time now) const {
  const Time flags = handed_out_ || wait_.cancelled != nullptr ? now + kLook : Time::max();
  return std::min(flags, time_up_.value_or(Time::max()));
}

}  // namespace warmfront::client
