// SPDX-License-Identifier: Apache-2.0
// Repeats, and what is carried out once. Thread safety as stated in the header.
#include "server/session/history.h"

#include <utility>

namespace warmfront::server {

Error answer_too_long(std::size_t bytes) {
  return {ErrorCode::kResourceExhausted,
          "its answer has " + std::to_string(bytes) +
              " bytes of contacts, which do not fit into one message; send the frame over StreamSteps, which "
              "answers in parts, or raise --max-message-bytes"};
}

FrameOutcome SessionHistory::repeated(const AdmittedFrame& frame) const {
  // By its bytes alone: the scene may have changed since they made a frame of it.
  if (!(frame.content == *last_content_))
    return Fault{ErrorCode::kAborted, Reason::kFrameChanged,
                 frame_name(frame.number) +
                     " was already answered for other content; number frames upwards, " +
                     frame_name(frames_.expected()) + " is next",
                 frames_.expected()};
  if (last_answer_->contact_bytes() > frame.pass.max_answer_bytes)
    return fault_from(answer_too_long(last_answer_->contact_bytes()),
                      frame_name(frame.number) + " is answered, but ", kMaxMessageBytes);
  return last_answer_;
}

std::size_t SessionHistory::memory_bytes() const {
  const auto* question = last_content_ ? std::get_if<FrameQuestion>(&*last_content_) : nullptr;
  return question != nullptr ? question->contents.memory_bytes() : 0;
}

const std::shared_ptr<const Answer>& SessionHistory::finish(std::shared_ptr<const Answer> answer,
                                                            std::optional<FrameContent>& content) noexcept {
  last_answer_ = std::move(answer);
  std::swap(last_content_, content);
  trial_.reset();
  frames_.advance();
  standing_ = {last_answer_->state, standing_.now};
  return last_answer_;
}

std::optional<Outcome<SessionState>> SessionHistory::repeated(const ChangeOrder& order) const {
  if (order.key.empty() || !done_order_ || order.key != done_order_->key) return std::nullopt;
  if (order.digest == done_order_->digest) return done_order_->state;
  return Fault{ErrorCode::kInvalidArgument, Reason::kInvalidInput,
               "key: other changes were carried out under this one; choose another for each request"};
}

const SessionState& SessionHistory::finish(ChangeOrder& order) noexcept {
  StateDigest digest(standing_.now.digest);
  digest.add(kDigestOfChange);
  digest.add(order.digest);
  standing_ = {{standing_.now.frame, standing_.now.revision + 1, digest.value()}, standing_.now};
  done_order_.reset();
  if (!order.key.empty()) done_order_ = {std::move(order.key), order.digest, standing_.now};
  return standing_.now;
}

}  // namespace warmfront::server
