// SPDX-License-Identifier: Apache-2.0
// A step, place or commit that was refused before it was sent, and what is asked behind it. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <memory>

#include "client/lib/pending.h"

namespace warmfront::client {

/// What is asked before somebody has waited for a refused step, place or commit was meant to begin where that
/// one would have ended: it is refused, too. Once somebody waited, the caller knows of the refusal, and
/// questions are sent again.
class RefusedFrame {
 public:
  /// The answer to a question that was refused. `counts`: it is a step, place or commit; `handed_out`: nobody
  /// waits for it yet, as PendingAnswer has it.
  std::shared_ptr<PendingAnswer> refuse(Error why, bool counts, bool handed_out);
  /// The answer to what is asked now, where a refused frame is before it and nobody knows of that; else null.
  /// A caller who waits for it is told of the refusal once.
  std::shared_ptr<PendingAnswer> refuse_behind(bool handed_out, std::uint64_t next_frame);

 private:
  class Answer;
  std::shared_ptr<bool> seen_;  // by somebody who waited; null: nothing was refused
};

}  // namespace warmfront::client
