// SPDX-License-Identifier: Apache-2.0
// What follows a turn, and the self-check. Thread safety as stated in session.h.
#include "server/session/session_turn.h"

#include <string>
#include <utility>

namespace warmfront::server {

Fault engine_failed(const char* what, const char* why) noexcept {
  const auto fault = [](std::string message) {
    return Fault{ErrorCode::kInternal, Reason::kEngine, std::move(message)};
  };
  try {
    return fault(std::string(what) + ": the engine failed: " + why);
  } catch (...) {
    return fault("engine failed");
  }
}

void Session::take_stock(std::chrono::steady_clock::duration took) {
  memory_.set(collider_.memory_bytes() + history_.memory_bytes());
  forecast_.took(std::chrono::duration<double, std::milli>(took).count(), collider_.scene().element_count(),
                 check_is_due());
  mailbox_->foresee(forecast_.lane(), forecast_.next_ms());
  const MutexLock lock(mutex_);
  snapshot_.state = history_.now();
  snapshot_.steps = history_.frames().steps();
  last_request_ = std::chrono::steady_clock::now();
}

Fault Session::given_up(const std::string& what) const {
  if (std::optional<Fault> fault = closed()) return *std::move(fault);
  return {ErrorCode::kCancelled, Reason::kCancelled,
          what + ": given up by its client; the session is as before it"};
}

bool Session::check_is_due() const {
  return limits_.self_check_steps > 0 && steps_unchecked_ >= limits_.self_check_steps;
}

void Session::check(CheckDone done, std::shared_ptr<std::atomic<bool>> given_up) {
  auto reply = std::make_shared<CheckDone>(std::move(done));
  const bool posted = mailbox_->post([in_hand = in_hand(), reply, given_up = std::move(given_up)] {
    Session& self = *in_hand->operator->();
    (*reply)(self.guarded<std::string>("the self-check", [&] {
      const Running running(self, given_up.get());
      return self.self_check("", running.stop());
    }));
  });
  if (!posted)
    (*reply)(limit_met("CheckSession: too many frames of this session wait; try again after an answer",
                       "window", true));
}

Outcome<std::string> Session::self_check(const std::string& where, const std::atomic<bool>* stop) {
  const Status sound = collider_.self_check(stop);
  if (!sound && sound.error().code == ErrorCode::kCancelled)
    return given_up(where.empty() ? "CheckSession" : where.substr(0, where.find(':')));
  steps_unchecked_ = 0;
  const bool lost = !sound && (sound.error().code == ErrorCode::kDataLoss || was_rebuilt_);
  using Check = SessionObserver::Check;
  if (observer_ != nullptr)
    observer_->self_checked(sound ? Check::kPassed : lost ? Check::kDataLost : Check::kRebuilt);
  if (sound) return std::string();
  const std::string& found = sound.error().message;
  if (lost)
    return Fault{ErrorCode::kDataLoss, Reason::kDataLoss,
                 where + found + (was_rebuilt_ ? ", after it was made anew once" : "") +
                     "; the session is dropped, create it again"};
  was_rebuilt_ = true;
  steps_unchecked_ = limits_.self_check_steps;  // what comes of it is checked after a step
  collider_.forget_warmth();
  if (rebuilt_) rebuilt_(*this, found);
  return found;
}

}  // namespace warmfront::server
