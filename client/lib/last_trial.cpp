// SPDX-License-Identifier: Apache-2.0
#include "client/lib/last_trial.h"

#include <utility>

namespace warmfront::client {

LastTrial::LastTrial(SentFrame frame, const Answer& answer)
    : frame_(std::move(frame)),
      kind_(answer.contacts.kind),
      status_(answer.contacts.status),
      toi_(answer.contacts.toi),
      vf_(answer.vf),
      ee_(answer.ee),
      vh_(answer.vh),
      possible_(answer.possible),
      earliest_toi_(answer.earliest_toi) {}

Error LastTrial::none() {
  return {ErrorCode::kFailedPrecondition,
          "no trial was answered since the last frame, change of the scene or its options, or request that "
          "failed; ask for a "
          "trial first"};
}

CommitResult LastTrial::up_to(double fraction) const {
  CommitResult result;
  result.fraction = fraction;
  if (earliest_toi_ && *earliest_toi_ <= fraction) result.earliest_toi = earliest_toi_;
  if (kind_.size() == vf_ + ee_ + vh_) {
    result.vf = result.ee = result.vh = result.possible = 0;
    for (std::size_t i = 0; i < kind_.size(); ++i) {
      if (toi_[i] > fraction) continue;
      ++*(kind_[i] == ContactKind::kVertexFace        ? result.vf
          : kind_[i] == ContactKind::kVertexHalfSpace ? result.vh
                                                      : result.ee);
      if (status_[i] == ContactStatus::kPossible || status_[i] == ContactStatus::kBudget) ++*result.possible;
    }
  } else if (fraction == 1) {
    result.vf = vf_;
    result.ee = ee_;
    result.vh = vh_;
    result.possible = possible_;
  } else if (!result.earliest_toi) {
    result.vf = result.ee = result.vh = result.possible = 0;
  }
  return result;
}

}  // namespace warmfront::client
