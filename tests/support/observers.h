// SPDX-License-Identifier: Apache-2.0
// Observers of a session's frames and changes that tell a function. As thread-safe as that is.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "server/session/session.h"

namespace warmfront::test {

/// An observer that calls `answered`, which must not throw, with the outcome, and `begins` before that.
template <class Observer, class Outcome, class Answered>
class Telling final : public Observer {
 public:
  Telling(Answered answered, std::function<void()> begins)
      : answered_(std::move(answered)), begins_(std::move(begins)) {}
  void begins() override {
    if (begins_) begins_();
  }
  void answered(const Outcome& outcome) noexcept override { answered_(outcome); }

 private:
  Answered answered_;
  const std::function<void()> begins_;
};

template <class Answered>
std::unique_ptr<server::FrameObserver> tell_frame(Answered answered, std::function<void()> begins = {}) {
  return std::make_unique<Telling<server::FrameObserver, server::FrameOutcome, Answered>>(std::move(answered),
                                                                                          std::move(begins));
}

template <class Answered>
std::unique_ptr<server::ChangeObserver> tell_change(Answered answered, std::function<void()> begins = {}) {
  return std::make_unique<Telling<server::ChangeObserver, server::Outcome<server::SessionState>, Answered>>(
      std::move(answered), std::move(begins));
}

}  // namespace warmfront::test
