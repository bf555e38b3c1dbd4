// SPDX-License-Identifier: Apache-2.0
#include "server/transport/frame_assembly.h"

#include <utility>

#include "server/transport/convert.h"

namespace warmfront::server {

Fault out_of_place(std::string message) {
  return {ErrorCode::kFailedPrecondition, Reason::kProtocol, "StreamSteps: " + std::move(message)};
}

FrameAssembly::FrameAssembly(Session& session, Gate& of_tenant, const Gate& of_daemon, std::uint64_t number)
    : spare_(session.spare_positions()),
      is_recorded_(session.companion() != nullptr),
      number_(number),
      contents_(session.dtype(), *session.scene()),
      pass_(admit_frame(of_tenant, of_daemon, session.account(), contents_.expected_bytes())),
      parts_(session.account()) {}

template <class Message>
void FrameAssembly::ask(const Message& first) {
  Outcome<Question> question = question_from(first);
  if (!question && !pass_.refused) pass_.refused = question.fault();
  question_ = question ? std::move(question).value() : refused_question(first);
}
template void FrameAssembly::ask(const v1::StepFrame& first);
template void FrameAssembly::ask(const v1::StepRequest& first);

std::optional<Fault> FrameAssembly::refusal_of(const v1::StepFrame& further) const {
  if (further.has_question())
    return out_of_place("a question in a later part of " + frame_name(further.frame()) +
                        "; ask it in the first");
  if (further.frame() != number_)
    return out_of_place(frame_name(further.frame()) + " begins within " + frame_name(number_) +
                        "; mark a frame's last part with more = false");
  return std::nullopt;
}

void FrameAssembly::expect_positions() {
  if (!std::exchange(has_positions_, true)) contents_.reuse(spare_.take());
}

void FrameAssembly::add(const StreamRequest& message) {
  if (!pass_.refused) {
    if (!message.positions.empty()) expect_positions();
    static_cast<void>(contents_.append(message.positions));
    append(message.message.step(), contents_);
    if (message.moved) static_cast<void>(contents_.append(*message.moved));
  }
  // Twice what a frame's positions take, for one that says which vertices moved, and what else it may say.
  constexpr std::size_t kRestOfFrameBytes = std::size_t{1} << 20;
  if (is_recorded_) parts_.add(message.whole_step(), 2 * contents_.expected_bytes() + kRestOfFrameBytes);
}

void FrameAssembly::add(const v1::StepRequest& message) {
  if (!message.positions().empty()) expect_positions();
  append(message, contents_);
  if (!is_recorded_) return;
  v1::StepFrame part;
  part.set_frame(message.frame());
  part.set_positions(message.positions());
  if (message.has_moved()) *part.mutable_moved() = message.moved();
  if (message.has_question()) *part.mutable_question() = message.question();
  parts_.add(std::move(part), RecordedParts::kOneMessage);
}

AdmittedFrame FrameAssembly::finish(std::unique_ptr<FrameObserver> observer) {
  return {number_, FrameQuestion{std::move(contents_), std::move(question_)}, std::move(pass_),
          std::move(observer)};
}

}  // namespace warmfront::server
