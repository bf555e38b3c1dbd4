// SPDX-License-Identifier: Apache-2.0
// What is asked of a session, wherever it is. Used by one thread at a time; see pending.h for what another
// one may do meanwhile.
#pragma once

#include <memory>

#include "client/lib/answer.h"
#include "client/lib/pending.h"
#include "engine/frame.h"
#include "engine/question.h"
#include "engine/result.h"

namespace warmfront::client {

/// The questions of Collider, waited for or not, of a session behind a daemon (Session) or anywhere
/// (AnySession): the same answers, of the same bits, and errors of the same codes.
class Questions {
 public:
  /// Submits a frame and takes its answer. `options`: of this step alone. `wait`: when to give it up, with
  /// kCancelled or kDeadlineExceeded; the frame does not count then, whether or not the daemon had carried it
  /// out, and the session is where it was. kFailedPrecondition while answers to what was submitted were not
  /// taken.
  Result<Answer> step(const Frame& frame, const QuestionOptions& options = {}, const WaitOptions& wait = {});
  /// Puts everything where the frame says, without a motion: the session's next frame, carried out once,
  /// whose answer tells of nothing. As Collider::place(). Fails as step() does, and with kInvalidArgument
  /// where the daemon is older than FEATURE_PLACE.
  Result<Answer> place(const Frame& frame, const WaitOptions& wait = {});
  /// What would this motion meet? As Collider::trial(): the session stays where it is. Fails as step() does,
  /// and with kUnimplemented where the daemon is older than trials.
  Result<Answer> trial(const Frame& frame, const QuestionOptions& options = {}, const WaitOptions& wait = {});
  /// How far may it go? As Collider::max_step(). Fails as trial() does.
  Result<MaxStep> max_step(const Frame& frame, bool leave_out_overlaps = false,
                           const QuestionOptions& options = {}, const WaitOptions& wait = {});
  /// Which pairs are near each other? As Collider::proximity(): the session stays where it is, and the last
  /// trial to be committed. Fails as trial() does, and with kFailedPrecondition for the end of a trial that
  /// there is not.
  Result<Answer> proximity(double distance, Where where = Where::kBase, const QuestionOptions& options = {},
                           const WaitOptions& wait = {});
  /// How far is each vertex from anything, at most `distance`? As Collider::vertex_distances(); fails as
  /// proximity().
  Result<Answer> vertex_distances(double distance, Where where = Where::kBase,
                                  const QuestionOptions& options = {}, const WaitOptions& wait = {});
  /// Which edges meet which faces? As Collider::intersections(); kInvalidArgument for options that it does
  /// not have (all but report and max_contacts), else fails as proximity().
  Result<Answer> intersections(Where where = Where::kBase, const QuestionOptions& options = {},
                               const WaitOptions& wait = {});
  /// Takes the last trial, or max_step(), up to `fraction` in [0, 1], which is the session's next frame: as
  /// Collider::commit(), rounded to the kind of positions that the session was created with. It is carried
  /// out once, even if the daemon is lost meanwhile. kFailedPrecondition without a trial that was
  /// answered last. Where it is given up, the trial may be committed still. A vertex that it moved is then at
  /// part_way(X, Y, fraction, single) of engine/part_way.h, where `single` is whether the session has
  /// float32; a pose likewise, or by screw_way() of engine/screw.h, both poses rounded by in_float32() before
  /// in such a session: for those who keep positions of their own. session.positions() and poses() have them.
  Result<CommitResult> commit(double fraction = 1, const WaitOptions& wait = {});

  /// The same without waiting: each sends what the window allows, and the rest in time. Nothing that is given
  /// is needed once they return, but for the flag of `wait`. A question that fails does not count
  /// as above; one that was asked after a step, place or commit that fails, and before that was waited for,
  /// fails with kFailedPrecondition, since its motion began where that one would have ended.
  Pending<Answer> step_async(const Frame& frame, const QuestionOptions& options = {},
                             const WaitOptions& wait = {});
  Pending<Answer> place_async(const Frame& frame, const WaitOptions& wait = {});
  Pending<Answer> trial_async(const Frame& frame, const QuestionOptions& options = {},
                              const WaitOptions& wait = {});
  Pending<MaxStep> max_step_async(const Frame& frame, bool leave_out_overlaps = false,
                                  const QuestionOptions& options = {}, const WaitOptions& wait = {});
  Pending<Answer> proximity_async(double distance, Where where = Where::kBase,
                                  const QuestionOptions& options = {}, const WaitOptions& wait = {});
  Pending<Answer> vertex_distances_async(double distance, Where where = Where::kBase,
                                         const QuestionOptions& options = {}, const WaitOptions& wait = {});
  Pending<Answer> intersections_async(Where where = Where::kBase, const QuestionOptions& options = {},
                                      const WaitOptions& wait = {});
  Pending<CommitResult> commit_async(double fraction = 1, const WaitOptions& wait = {});

 protected:
  Questions() = default;
  ~Questions() = default;
  Questions(Questions&&) = default;
  Questions& operator=(Questions&&) = default;

 private:
  /// Asks without waiting; what fails at once is a settled answer. `handed_out`: as PendingAnswer has it; if
  /// not, the answer is waited for at once, and the frame stays as it is until then.
  virtual std::shared_ptr<PendingAnswer> ask(const Frame& frame, const Question& question,
                                             const WaitOptions& wait, bool handed_out) = 0;
  /// The same, of a commit: its answer has nothing else.
  virtual std::shared_ptr<PendingAnswer> ask_commit(double fraction, const WaitOptions& wait,
                                                    bool handed_out) = 0;
};

}  // namespace warmfront::client
