// SPDX-License-Identifier: Apache-2.0
// The trial that hierarchies and front were last brought to. A later trial that goes part of its way, as
// those of a line search do, can meet nothing that it did not meet. Used by one thread at a time, inside
// Workers::run().
#pragma once

#include <cstddef>

#include "engine/motion/trial_way.h"
#include "engine/options.h"
#include "engine/state/core.h"
#include "engine/stop.h"

namespace warmfront {

class LongestTrial {
 public:
  /// Does the motion that was begun, a trial from the same start, go part of this one's way, as far as this
  /// one looked, and was what it left out without a look left out for what is asked for now, too? Then the
  /// bounds that this one was answered with contain its own. `magnitude`: that of these bounds. Places what
  /// is not placed. Throws Stopped when told to stop.
  bool contains_motion(Core& core, double magnitude, StopSignal stop);
  /// Did the last question go part of the way, and if so, what fraction of it?
  bool shortened() const { return shortened_; }
  double fraction() const { return fraction_; }

  struct Found {
    bool left_out;  ///< pairs within parts, or of parts, without a look
    bool kept;      ///< met what was found by questions before it
  };
  /// Remembers the trial that was begun, unless vertices move one by one. Throws Stopped when told to stop.
  void remember(const Core& core, const Found& found, StopSignal stop);
  /// Its answer is complete up to this time.
  void looked_until(double time) noexcept { until_ = time; }
  void forget() noexcept { way_.forget(); }
  /// Begins a question of its own. Returns whether the last one was shortened: then bounds are not those of
  /// the last motion.
  bool begin_other();

  std::size_t memory_bytes() const { return way_.memory_bytes(); }

 private:
  bool serves(const ColliderOptions& now, const KeepDistance& keep) const;

  TrialWay way_;           // known: others may go part of it
  ColliderOptions asked_;  // that it was asked by
  KeepDistance keep_;
  Found found_{};
  double until_ = 0;
  bool shortened_ = false;
  double fraction_ = 1;
};

}  // namespace warmfront
