// SPDX-License-Identifier: Apache-2.0
// The last trial that was answered: what a commit is of. Used by one thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/lib/answer.h"
#include "client/lib/sent_frame.h"
#include "engine/result.h"

namespace warmfront::client {

class LastTrial {
 public:
  /// The frame that asked for it, and its answer: of that, as much as a commit tells of it is kept.
  LastTrial(SentFrame frame, const Answer& answer);

  /// The error of a commit, or of a question about a trial's end, where there is no trial.
  static Error none();

  const SentFrame& frame() const { return frame_; }
  /// What a commit of this part of it answers, as Collider::commit() has it. By what the caller was told of
  /// the trial: a daemon that was told of the trial again had only to count.
  CommitResult up_to(double fraction) const;

 private:
  SentFrame frame_;
  std::vector<ContactKind> kind_;
  std::vector<ContactStatus> status_;
  std::vector<double> toi_;
  std::uint64_t vf_;
  std::uint64_t ee_;
  std::uint64_t vh_;
  std::uint64_t possible_;
  std::optional<double> earliest_toi_;
};

}  // namespace warmfront::client
