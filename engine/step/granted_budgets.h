// SPDX-License-Identifier: Apache-2.0
// Where a question grants the front's budgets: at the end of its motion, or where that begins. Used by one
// thread at a time.
#pragma once

#include <cstdint>
#include <utility>

#include "engine/bounds/overlap.h"
#include "engine/motion/scene_motion.h"

namespace warmfront {

/// Budgets are granted where the next motion begins, most likely: at the end of a trial that will be taken,
/// at the base of several of which none is part of another's way. Whoever asked for several from the last
/// base may do so from this one.
class GrantedBudgets {
 public:
  /// A question begins, after its motion; `question`: of a motion that is only asked about.
  void begin(const SceneMotion& motion, bool question) {
    if (motion.from() == From::kEnd) {
      several_before_ = std::exchange(several_, false);
      left_base_ = false;
    }
    several_ |= left_base_;
    gap_at_ = question && (several_before_ || several_) ? GapAt::kStart : GapAt::kEnd;
    at_end_ = question && gap_at_ == GapAt::kEnd;
    for (PartId p{0}; p < motion.end_part() && !left_base_; ++p)
      left_base_ = (motion.state(p) & kMoving) != 0;
  }

  GapAt gap_at() const { return gap_at_; }
  /// Were they granted at the end of a trial that still counts?
  bool at_trial_end() const { return at_end_; }
  /// The same; that trial counts no more.
  bool leave_trial_end() { return std::exchange(at_end_, false); }

 private:
  GapAt gap_at_ = GapAt::kEnd;
  bool at_end_ = false;
  // Of the questions since motions begin where they do: had one of them a motion, or several? And of those
  // before?
  bool left_base_ = false;
  bool several_ = false;
  bool several_before_ = false;
};

}  // namespace warmfront
