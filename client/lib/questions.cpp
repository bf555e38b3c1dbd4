// SPDX-License-Identifier: Apache-2.0
#include "client/lib/questions.h"

#include <utility>

namespace warmfront::client {
namespace {

using Asked = std::shared_ptr<PendingAnswer>;

Pending<Answer> pending_answer(Asked asked) {
  return {std::move(asked), [](Answer answer) { return answer; }};
}

Pending<CommitResult> pending_commit(Asked asked) {
  return {std::move(asked), [](Answer answer) { return answer.commit.value(); }};
}

Pending<MaxStep> pending_max_step(Asked asked) {
  return {std::move(asked), [](Answer answer) { return MaxStep::of(std::move(answer)); }};
}

}  // namespace

Result<Answer> Questions::step(const Frame& frame, const QuestionOptions& options, const WaitOptions& wait) {
  return ask(frame, {.options = options}, wait, false)->take();
}
Result<Answer> Questions::place(const Frame& frame, const WaitOptions& wait) {
  return ask(frame, {QuestionKind::kPlace}, wait, false)->take();
}
Result<Answer> Questions::trial(const Frame& frame, const QuestionOptions& options, const WaitOptions& wait) {
  return ask(frame, {QuestionKind::kTrial, options}, wait, false)->take();
}
Result<MaxStep> Questions::max_step(const Frame& frame, bool leave_out_overlaps,
                                    const QuestionOptions& options, const WaitOptions& wait) {
  return pending_max_step(ask(frame, {QuestionKind::kMaxStep, options, leave_out_overlaps}, wait, false))
      .get();
}
Result<Answer> Questions::proximity(double distance, Where where, const QuestionOptions& options,
                                    const WaitOptions& wait) {
  return ask(Frame(), Question::proximity(distance, where, options), wait, false)->take();
}
Result<Answer> Questions::vertex_distances(double distance, Where where, const QuestionOptions& options,
                                           const WaitOptions& wait) {
  return ask(Frame(), Question::vertex_distances(distance, where, options), wait, false)->take();
}
Result<Answer> Questions::intersections(Where where, const QuestionOptions& options,
                                        const WaitOptions& wait) {
  return ask(Frame(), Question::intersections(where, options), wait, false)->take();
}
Result<CommitResult> Questions::commit(double fraction, const WaitOptions& wait) {
  return pending_commit(ask_commit(fraction, wait, false)).get();
}

Pending<Answer> Questions::step_async(const Frame& frame, const QuestionOptions& options,
                                      const WaitOptions& wait) {
  return pending_answer(ask(frame, {.options = options}, wait, true));
}
Pending<Answer> Questions::place_async(const Frame& frame, const WaitOptions& wait) {
  return pending_answer(ask(frame, {QuestionKind::kPlace}, wait, true));
}
Pending<Answer> Questions::trial_async(const Frame& frame, const QuestionOptions& options,
                                       const WaitOptions& wait) {
  return pending_answer(ask(frame, {QuestionKind::kTrial, options}, wait, true));
}
Pending<MaxStep> Questions::max_step_async(const Frame& frame, bool leave_out_overlaps,
                                           const QuestionOptions& options, const WaitOptions& wait) {
  return pending_max_step(ask(frame, {QuestionKind::kMaxStep, options, leave_out_overlaps}, wait, true));
}
Pending<Answer> Questions::proximity_async(double distance, Where where, const QuestionOptions& options,
                                           const WaitOptions& wait) {
  return pending_answer(ask(Frame(), Question::proximity(distance, where, options), wait, true));
}
Pending<Answer> Questions::vertex_distances_async(double distance, Where where,
                                                  const QuestionOptions& options, const WaitOptions& wait) {
  return pending_answer(ask(Frame(), Question::vertex_distances(distance, where, options), wait, true));
}
Pending<Answer> Questions::intersections_async(Where where, const QuestionOptions& options,
                                               const WaitOptions& wait) {
  return pending_answer(ask(Frame(), Question::intersections(where, options), wait, true));
}
Pending<CommitResult> Questions::commit_async(double fraction, const WaitOptions& wait) {
  return pending_commit(ask_commit(fraction, wait, true));
}

}  // namespace warmfront::client
