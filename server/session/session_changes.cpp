// SPDX-License-Identifier: Apache-2.0
// Changes of a session's scene and options, in its turn. Thread safety as stated in session.h.
#include <algorithm>
#include <string>
#include <utility>

#include "server/session/scene_growth.h"
#include "server/session/session_turn.h"

namespace warmfront::server {
namespace {

std::string text_of(const SessionState& state) {
  return frame_name(state.frame) + ", revision " + std::to_string(state.revision);
}

}  // namespace

void Session::change(ChangeOrder given, std::unique_ptr<ChangeObserver> observer) {
  // Shared, because a std::function must be copyable, and the order is answered on whichever of two paths is
  // taken.
  auto order = std::make_shared<ChangeOrder>(std::move(given));
  const std::shared_ptr<ChangeObserver> told = std::move(observer);
  if (mailbox_->post([in_hand = in_hand(), order, told] { (*in_hand)->carry_out(*order, *told); })) return;
  order->give_back();
  told->answered(limit_met("ChangeScene: too many frames of this session wait; try again after an answer",
                           "window", true));
}

void Session::carry_out(ChangeOrder& order, ChangeObserver& observer) noexcept {
  const Outcome<SessionState> outcome =
      guarded<SessionState>("changing the scene", [&] { return apply(order, observer); });
  // What the changes held is free before their client hears of them.
  order.give_back();
  observer.answered(outcome);
}

std::optional<Fault> Session::refusal_of(const ChangeOrder& order) const {
  const Scene& scene = collider_.scene();
  if (order.expected && *order.expected != history_.now())
    return Fault{ErrorCode::kAborted, Reason::kStateChanged,
                 "expected_state: the session is not in this state (" + text_of(*order.expected) +
                     ") but in another (" + text_of(history_.now()) +
                     "): another copy was changed or stepped meanwhile; attach to see",
                 history_.frames().expected()};
  if (order.next_frame != history_.frames().expected())
    return Fault{ErrorCode::kFailedPrecondition, Reason::kFrameOutOfOrder,
                 "next_frame: " + frame_name(order.next_frame) + " is out of order: frame " +
                     std::to_string(history_.frames().expected()) + " is expected",
                 history_.frames().expected()};
  if (std::optional<Fault> fault = too_large_with(scene, order.changes, limits_))
    return with_removed(*std::move(fault), scene);
  if (std::optional<Fault> refusal = account_->refusal(more_with(order)))
    return with_removed(*std::move(refusal), scene);
  return std::nullopt;
}

// What is estimated for the growth covers the changes as they wait, too.
std::size_t Session::more_with(const ChangeOrder& order) const {
  const std::size_t growth =
      growth_with(collider_.scene(), order.changes, {size_of(dtype_), collider_.options().explain, limits_});
  return growth - std::min(growth, order.memory.bytes());
}

Outcome<SessionState> Session::apply(ChangeOrder& order, ChangeObserver& observer) {
  if (std::optional<Outcome<SessionState>> repeated = history_.repeated(order)) return *std::move(repeated);
  history_.forget_trial();
  observer.begins();
  const Running running(*this, order.given_up.get());
  if (std::optional<Fault> refusal = refusal_of(order)) return *std::move(refusal);
  // Charged before it grows, so that others who ask meanwhile see it; take_stock() knows what it became.
  const Holding growth(account_, more_with(order));
  std::size_t failed = 0;
  const std::size_t count = order.changes.size();
  if (Status status = collider_.change(std::move(order.changes), running.stop(), &failed, order.options);
      !status) {
    if (status.error().code == ErrorCode::kCancelled) return given_up("ChangeScene");
    return fault_from(status.error(),
                      failed < count ? "changes[" + std::to_string(failed) + "]: " : "options.",
                      kAdjacentFaces);
  }
  std::shared_ptr<const Scene> scene = collider_.shared_scene();  // nothing that follows may fail
  const SessionState& now = history_.finish(order);
  const MutexLock lock(mutex_);
  scene_ = std::move(scene);
  options_ = collider_.options();
  return now;
}

}  // namespace warmfront::server
