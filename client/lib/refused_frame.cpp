// SPDX-License-Identifier: Apache-2.0
#include "client/lib/refused_frame.h"

#include <utility>

#include "client/lib/frame_cost.h"

namespace warmfront::client {

class RefusedFrame::Answer final : public PendingAnswer {
 public:
  Answer(Error why, std::shared_ptr<bool> seen) : PendingAnswer(std::move(why)), seen_(std::move(seen)) {}
  bool wait_until(Time /*until*/) override { return *seen_ = true; }

 private:
  const std::shared_ptr<bool> seen_;
};

std::shared_ptr<PendingAnswer> RefusedFrame::refuse(Error why, bool counts, bool handed_out) {
  if (!counts || !handed_out) return std::make_shared<PendingAnswer>(std::move(why));
  seen_ = std::make_shared<bool>(false);
  return std::make_shared<Answer>(std::move(why), seen_);
}

std::shared_ptr<PendingAnswer> RefusedFrame::refuse_behind(bool handed_out, std::uint64_t next_frame) {
  const std::shared_ptr<bool> seen = handed_out ? seen_ : std::exchange(seen_, nullptr);
  if (seen == nullptr || *seen) return nullptr;
  return std::make_shared<Answer>(
      Error{ErrorCode::kFailedPrecondition,
            "a frame before it failed, and " + frame_name(next_frame) + " is the next one"},
      seen);
}

}  // namespace warmfront::client
